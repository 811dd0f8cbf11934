// uPlot curves in the page's colours, sized to their box.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { chart } from "./colors";
import { h, show_if } from "./dom";

export interface Curve {
  label: string;
  color: string;
  unit: string;
  axis?: "left" | "right";
  dash?: number[];
  points?: boolean;
}
export interface ChartOptions {
  test_id: string;
  title: string;
  x_label: string;
  curves: Curve[];
  log?: boolean;
  /// A vertical line at this x (the current step); undefined: none.
  cursor_x?: () => number | undefined;
  cursor_color?: () => string;
  on_pick?: (x: number) => void;
}

const font = '11px system-ui, sans-serif';

function short(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e4 || size < 1e-3 ? value.toExponential(0) : String(Number(value.toPrecision(3)));
}

function axis(curve: Curve, side: 1 | 3, log: boolean): uPlot.Axis {
  return {
    scale: side === 3 ? "left" : "right", side, size: 44, gap: 4, font, stroke: curve.color, ticks: { show: false },
    grid: { show: side === 3, stroke: chart.grid, width: 1 },
    values: (_, splits) => splits.map((v) => (v === null ? "" : short(v))),
    ...(log ? {} : { space: 28 }),
  };
}

/// A chart that keeps its box: no data shows the title and an empty frame.
export class Chart {
  readonly element: HTMLElement;
  private readonly box = h("div", { class: "chart-box" });
  private readonly empty = h("p", { class: "chart-empty" });
  private plot: uPlot | null = null;
  private data: uPlot.AlignedData;

  constructor(private readonly options: ChartOptions) {
    this.data = [[], ...options.curves.map(() => [])];
    const legend = options.curves.map((curve) => {
      const swatch = h("i", { class: curve.dash ? "swatch dashed" : "swatch" });
      swatch.style.setProperty("--swatch", curve.color);
      return h("span", { class: "legend" }, swatch, curve.unit ? `${curve.label} [${curve.unit}]` : curve.label);
    });
    this.element = h("figure", { class: "chart", "data-testid": options.test_id },
      h("figcaption", {}, h("span", { class: "chart-title" }, options.title), h("span", { class: "legends" }, ...legend)),
      this.box, this.empty);
    new ResizeObserver(() => this.fit()).observe(this.box);
  }

  /// x ascending, then one array per curve; null leaves a gap.
  set(data: (number | null)[][], empty_note = ""): void {
    this.data = data as unknown as uPlot.AlignedData;
    const points = data[0]?.length ?? 0;
    this.element.dataset.points = String(points);
    this.empty.textContent = empty_note;
    this.box.style.visibility = points === 0 ? "hidden" : "visible";
    show_if(this.empty, points === 0 && empty_note !== "");
    if (this.plot) this.plot.setData(this.data);
    else this.fit();
  }

  redraw(): void {
    this.plot?.redraw(false, false);
  }

  private fit(): void {
    const width = this.box.clientWidth;
    const height = this.box.clientHeight;
    if (width < 40 || height < 40) return;
    if (this.plot) this.plot.setSize({ width, height });
    else this.plot = new uPlot(this.uplot_options(width, height), this.data, this.box);
  }

  private uplot_options(width: number, height: number): uPlot.Options {
    const { curves, log = false, x_label } = this.options;
    const left = curves.find((c) => c.axis !== "right");
    const right = curves.find((c) => c.axis === "right");
    const axes: uPlot.Axis[] = [
      { scale: "x", label: x_label, labelSize: 16, labelGap: 0, labelFont: font, size: 26, font, stroke: chart.text,
        ticks: { show: false }, grid: { stroke: chart.grid, width: 1 }, values: (_, splits) => splits.map((v) => short(v)) },
    ];
    if (left) axes.push(axis(left, 3, log));
    if (right) axes.push(axis(right, 1, false));
    return {
      width, height, axes, padding: [8, right ? 0 : 10, 0, 0], legend: { show: false },
      cursor: { y: false, drag: { x: false, y: false }, points: { size: 6 } },
      scales: { x: { time: false }, left: log ? { distr: 3 } : { range: from_zero }, ...(right ? { right: { range: from_zero } } : {}) },
      series: [{}, ...curves.map((curve): uPlot.Series => ({
        label: curve.label, scale: curve.axis === "right" ? "right" : "left", stroke: curve.color, width: 1.75,
        ...(curve.dash ? { dash: curve.dash } : {}), spanGaps: true, points: { show: curve.points ?? false, size: 5, fill: curve.color },
      }))],
      hooks: { draw: [(u) => this.draw_cursor(u)], ready: [(u) => this.listen(u)] },
    };
  }

  private draw_cursor(u: uPlot): void {
    const x = this.options.cursor_x?.();
    if (x === undefined || (this.data[0]?.length ?? 0) === 0) return;
    const at = Math.round(u.valToPos(x, "x", true));
    const { ctx, bbox } = u;
    ctx.save();
    ctx.strokeStyle = this.options.cursor_color?.() ?? chart.neutral;
    ctx.lineWidth = 2 * devicePixelRatio;
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.moveTo(at, bbox.top);
    ctx.lineTo(at, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  private listen(u: uPlot): void {
    const pick = this.options.on_pick;
    if (!pick) return;
    u.over.addEventListener("click", () => {
      if (u.cursor.left !== undefined && u.cursor.left >= 0) pick(u.posToVal(u.cursor.left, "x"));
    });
  }
}

function from_zero(_: uPlot, low: number | null, high: number | null): uPlot.Range.MinMax {
  if (low === null || high === null) return [0, 1];
  return [Math.min(0, low), high > 0 ? high * 1.08 : 1];
}
