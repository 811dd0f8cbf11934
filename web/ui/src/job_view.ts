// One job: what it does now, how far it is, how it ended, and a way to stop it.
import { act, is_over } from "./actions";
import { api } from "./api";
import { fill, h, set_text, show_if } from "./dom";
import { percent } from "./format";
import { store } from "./store";
import type { Job } from "./types";

export interface JobView {
  element: HTMLElement;
  follow(id: string | null): void;
}

/// `describe` tells what a finished job brought; the default says whether it succeeded.
export function job_view(test_id: string, describe: (job: Job) => Node | string = outcome): JobView {
  const bar = h("progress", { max: 1, value: 0, "aria-label": "progress" });
  const text = h("span", { class: "job-text" });
  const cancel = h("button", { type: "button", class: "icon small", "aria-label": "cancel the job", title: "cancel",
    onclick: () => void act(() => api.cancel(followed ?? "")) }, "×");
  const element = h("div", { class: "job", role: "status", "data-testid": test_id }, text, bar, cancel);
  let followed: string | null = null;
  const draw = (job: Job | undefined) => {
    show_if(element, followed !== null);
    const over = job !== undefined && is_over(job);
    element.dataset.state = job?.state ?? "queued";
    text.title = job?.error?.message ?? job?.message ?? ""; // where there is room for two lines only
    bar.value = over ? 1 : (job?.progress ?? 0);
    show_if(bar, !over);
    show_if(cancel, !over);
    if (!job) set_text(text, "waiting …");
    else if (job.state === "failed") {
      fill(text, h("b", {}, "Failed. "), job.error?.message ?? job.message, job.error?.where ? h("code", {}, job.error.where) : null);
    } else if (job.state === "cancelled") set_text(text, "Cancelled.");
    else if (job.state === "done") fill(text, describe(job));
    else set_text(text, `${job.message || job.kind}${job.progress > 0 ? ` · ${percent(job.progress)}` : ""}`);
  };
  store.watch((s) => [followed ? s.jobs.get(followed) : undefined] as const, (job) => draw(job));
  return {
    element,
    follow(id) {
      followed = id;
      draw(id ? store.state.jobs.get(id) : undefined);
    },
  };
}

export function outcome(job: Job): string {
  if (job.result?.demo) return `Saved as demonstration ${job.result.demo}.`;
  if (job.result?.success === false) return `Finished, but the task is not done${job.message ? `: ${job.message}` : "."}`;
  return "Done; the task succeeded.";
}
