// A number over the last seconds, with the threshold that it has to pass.
import { svg } from "../dom";

export interface Moment { time_s: number; value: number }

const width = 72, height = 20, margin = 2;

/// Forgets what is older than `seconds`, and everything when time runs backwards.
export class Sparkline {
  readonly element: SVGSVGElement;
  private readonly line = svg("polyline", { class: "spark-line" });
  private readonly limit = svg("line", { class: "spark-limit", x1: 0, x2: width });
  private readonly head = svg("circle", { class: "spark-head", r: 2 });
  private moments: Moment[] = [];

  constructor(private readonly seconds: number, name: string) {
    this.element = svg("svg", { class: "spark", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": name, "data-testid": "term-spark" },
      this.limit, this.line, this.head);
  }

  add(moment: Moment, threshold: number): void {
    const last = this.moments.at(-1);
    if (last && moment.time_s < last.time_s) this.moments = [];
    if (last?.time_s === moment.time_s) this.moments.pop();
    this.moments.push(moment);
    this.moments = this.moments.filter((m) => m.time_s >= moment.time_s - this.seconds);
    this.draw(threshold);
  }

  private draw(threshold: number): void {
    const now = this.moments.at(-1)?.time_s ?? 0;
    const values = [threshold, 0, ...this.moments.map((m) => m.value)];
    const low = Math.min(...values), span = Math.max(Math.max(...values) - low, 1e-9) * 1.05;
    const x = (time_s: number) => width - margin - ((now - time_s) / this.seconds) * (width - 2 * margin);
    const y = (value: number) => height - margin - ((value - low) / span) * (height - 2 * margin);
    this.line.setAttribute("points", this.moments.map((m) => `${x(m.time_s).toFixed(1)},${y(m.value).toFixed(1)}`).join(" "));
    this.limit.setAttribute("y1", y(threshold).toFixed(1));
    this.limit.setAttribute("y2", y(threshold).toFixed(1));
    const last = this.moments.at(-1);
    if (!last) return;
    this.head.setAttribute("cx", x(last.time_s).toFixed(1));
    this.head.setAttribute("cy", y(last.value).toFixed(1));
  }
}
