// Puts the page together and connects it.
import { load_everything, report, take_event } from "./actions";
import { connection_banner, notice_line } from "./banner";
import { h } from "./dom";
import { Events } from "./events";
import { episode_keys, next_episode, redo_episode } from "./episodes";
import { header } from "./header";
import { listen_to_jog_keys } from "./jog";
import { listen_to_keys } from "./keys";
import { start_playback } from "./playback";
import { start_script } from "./script_actions";
import { store } from "./store";
import { side } from "./tabs";
import { timeline } from "./timeline";
import { view } from "./view";
import "./styles.css";

document.body.append(h("div", { class: "page" }, header(redo_episode, next_episode), h("main", { class: "left" }, connection_banner(), view(), timeline()), side(), notice_line()));

const press = (test_id: string) => document.querySelector<HTMLButtonElement>(`[data-testid="${test_id}"]`)?.click();
listen_to_keys({ ...episode_keys, p: () => press("predict"), Escape: () => store.set({ pick: null }) });
listen_to_jog_keys();
start_script();
start_playback();
void new Events(() => void load_everything().catch(report), take_event).connect();
