// Lines over the page: the connection's state, and the newest message with what to do next.
import { fill, h, set_text, show_if } from "./dom";
import { store } from "./store";

export function connection_banner(): HTMLElement {
  const text = h("span");
  const banner = h("div", { class: "banner", role: "status", "data-testid": "banner" }, text);
  const write = () => {
    const { connection, loading_message, retry_at } = store.state;
    banner.dataset.tone = connection === "lost" ? "failure" : "action";
    if (connection === "loading") set_text(text, `flowscope is starting${loading_message ? `: ${loading_message}` : " …"}`);
    if (connection === "lost") {
      const seconds = Math.max(0, Math.ceil((retry_at - Date.now()) / 1000));
      set_text(text, `Connection lost. The picture is not live. Trying again ${seconds > 0 ? `in ${seconds} s` : "now"}; ` +
        "if this stays, see whether flowscope still runs.");
    }
  };
  window.setInterval(() => {
    if (store.state.connection === "lost") write();
  }, 1000);
  store.watch((s) => [s.connection, s.loading_message, s.retry_at] as const, (connection) => {
    show_if(banner, connection === "lost" || connection === "loading");
    write();
  });
  return banner;
}

export function notice_line(): HTMLElement {
  const text = h("span", { class: "notice-text" });
  const close = h("button", { type: "button", class: "icon small", "aria-label": "dismiss", onclick: () => store.set({ notice: null }) }, "×");
  const line = h("div", { class: "notice", role: "alert", "data-testid": "notice" }, text, close);
  store.watch((s) => [s.notice] as const, (notice) => {
    show_if(line, notice !== null);
    if (!notice) return;
    line.dataset.tone = notice.level === "error" ? "failure" : "action";
    fill(text, notice.message, notice.where ? h("code", {}, notice.where) : null);
  });
  return line;
}
