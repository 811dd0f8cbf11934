// The task's success terms, living: each with its value against its threshold over the last seconds, in the task's own tree.
import { fill, h, set_text, show_if } from "../dom";
import { store } from "../store";
import type { Snapshot, SuccessTerm } from "../types";
import { view_toggle } from "../view_toggle";
import { Sparkline } from "./sparkline";

const seconds = 8;
const words: Record<string, string> = { all: "all of", any: "any of", in_order: "one after the other" };

/// The groups around a term, outermost first: "all/1/in_order/0" lies in "all" and in "all/1/in_order".
function groups_of(path: string): string[] {
  const parts = path === "" ? [] : path.split("/");
  return parts.flatMap((_, i) => (i % 2 === 0 ? [parts.slice(0, i + 1).join("/")] : []));
}

const readable = (text: string) => text.replaceAll("_", " ");

function threshold_text({ unit, threshold, wanted }: SuccessTerm): string {
  if (threshold === null || unit === "") return "";
  const sign = wanted === "above" ? ">" : "≤";
  return unit === "rad" ? `${sign} ${((threshold * 180) / Math.PI).toFixed(1)} deg` : `${sign} ${(threshold * 1000).toFixed(1)} mm`;
}

class Row {
  readonly element: HTMLElement;
  private readonly mark = h("i", { class: "mark" });
  private readonly value = h("b", { "data-testid": "term-value" });
  private readonly limit = h("span", { class: "quiet", "data-testid": "term-threshold" });
  private readonly since = h("span", { class: "quiet since", "data-testid": "term-since" });
  private readonly spark: Sparkline;

  constructor(term: SuccessTerm, depth: number) {
    this.spark = new Sparkline(seconds, `${term.name} over the last ${seconds} s`);
    this.element = h("li", { class: "term", title: term.path, "data-testid": "term", "data-path": term.path },
      this.mark, h("span", { class: "term-name" }, readable(term.name)), this.value, this.limit, this.spark.element, this.since);
    this.element.style.setProperty("--depth", String(depth));
  }

  show(term: SuccessTerm, time_s: number): void {
    this.element.dataset.met = String(term.met);
    set_text(this.mark, term.met ? "✓" : "·");
    set_text(this.value, term.value);
    set_text(this.limit, threshold_text(term));
    set_text(this.since, term.first_met_s === null ? "" : `at ${term.first_met_s.toFixed(1)} s`);
    this.since.title = term.first_met_s === null ? "" : "seconds of the episode at which it first became true";
    if (term.measured !== null && term.threshold !== null) this.spark.add({ time_s, value: term.measured }, term.threshold);
  }
}

function detector_toggle(): HTMLElement {
  return h("label", { class: "check", title: "draw the volumes and ways that the terms watch" }, view_toggle("detectors", false), "draw detectors");
}

/// The section for the Record panel.
export function terms_block(): HTMLElement {
  const list = h("ul", { class: "terms", "data-testid": "terms" });
  const none = h("p", { class: "quiet" }, "no success terms known yet");
  let rows: Row[] = [];
  let shape = "";

  const build = (terms: SuccessTerm[]) => {
    const items: HTMLElement[] = [];
    const headed = new Set<string>();
    rows = terms.map((term) => {
      const groups = groups_of(term.path);
      groups.forEach((group, depth) => {
        if (headed.has(group)) return;
        headed.add(group);
        const heading = h("li", { class: "term-group" }, words[group.split("/").at(-1) ?? ""] ?? "");
        heading.style.setProperty("--depth", String(depth));
        items.push(heading);
      });
      const row = new Row(term, groups.length);
      items.push(row.element);
      return row;
    });
    fill(list, ...items);
  };
  store.watch((s): readonly [Snapshot | null] => [s.snapshot], (snapshot) => {
    const terms = snapshot?.terms ?? [];
    show_if(none, terms.length === 0);
    const wanted = `${snapshot?.task} ${snapshot?.episode} ${terms.map((t) => `${t.path} ${t.name}`).join("|")}`;
    if (wanted !== shape) build(terms);
    shape = wanted;
    terms.forEach((term, i) => rows[i]?.show(term, snapshot?.time_s ?? 0));
  });
  return h("section", { class: "block" }, h("div", { class: "row spread" }, h("h2", {}, "Success"), detector_toggle()), none, list);
}
