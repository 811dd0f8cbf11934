// Puts the page together and connects it.
import { act, load_everything, report, take_event } from "./actions";
import { connection_banner, notice_line } from "./banner";
import { h } from "./dom";
import { Events } from "./events";
import { header, next_seed, reset_scene } from "./header";
import { listen_to_keys } from "./keys";
import { start_playback } from "./playback";
import { side } from "./tabs";
import { timeline } from "./timeline";
import { view } from "./view";
import "./styles.css";

document.body.append(h("div", { class: "page" }, header(), h("main", { class: "left" }, connection_banner(), view(), timeline()), side(), notice_line()));

const press = (test_id: string) => document.querySelector<HTMLButtonElement>(`[data-testid="${test_id}"]`)?.click();
listen_to_keys({ r: () => void reset_scene(), n: () => void act(next_seed), p: () => press("predict") });
start_playback();
void new Events(() => void load_everything().catch(report), take_event).connect();
