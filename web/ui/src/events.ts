// One WebSocket for everything that changes. Lost: the page says so and comes back by itself, waiting 0.5 s to 8 s.
import { address, api } from "./api";
import { store } from "./store";
import type { ServerEvent } from "./types";

const first_wait_ms = 500;
const longest_wait_ms = 8000;

/// `on_live` runs after every (re)connection, before the first event is delivered.
export class Events {
  private wait_ms = first_wait_ms;
  private timer = 0;

  constructor(private readonly on_live: () => void, private readonly on_event: (event: ServerEvent) => void) {}

  async connect(): Promise<void> {
    clearTimeout(this.timer);
    try {
      const health = await api.health();
      if (health.status !== "ready") {
        store.set({ connection: "loading", loading_message: health.message ?? "" });
        this.timer = window.setTimeout(() => void this.connect(), first_wait_ms);
        return;
      }
    } catch {
      this.lost();
      return;
    }
    this.open();
  }

  private open(): void {
    const socket = new WebSocket(address("api/v1/events").replace(/^http/, "ws"));
    socket.onopen = () => {
      this.wait_ms = first_wait_ms;
      store.set({ connection: "live", retry_at: 0 });
      this.on_live();
    };
    socket.onmessage = (message) => this.on_event(JSON.parse(String(message.data)) as ServerEvent);
    socket.onclose = () => this.lost();
  }

  private lost(): void {
    store.set({ connection: "lost", playing: false, retry_at: Date.now() + this.wait_ms });
    this.timer = window.setTimeout(() => void this.connect(), this.wait_ms);
    this.wait_ms = Math.min(2 * this.wait_ms, longest_wait_ms);
  }
}
