// Export: figures and films for papers and reports; what, how large, and the finished file.
import { act, job_over } from "../actions";
import { address, api, type ExportOptions } from "../api";
import { field, fill, h, number_input, read_number, set_options, set_text } from "../dom";
import { job_view } from "../job_view";
import { store } from "../store";
import type { Job } from "../types";

type Source = "view" | "trace" | "demo";
type Kind = ExportOptions["kind"];

function film(url: string): HTMLVideoElement {
  const video = h("video", { class: "preview", controls: true, autoplay: true, loop: true, playsinline: true, "data-testid": "export-video" });
  video.muted = true; // as a property: the attribute counts only in parsed pages, and only muted films start by themselves
  video.src = url;
  return video;
}

function finished(job: Job): Node | string {
  if (!job.result?.url) return "Done.";
  const url = address(job.result.url);
  const name = url.split("/").pop() ?? "file";
  const preview = url.includes(".ply") ? null : url.includes(".mp4")
    ? film(url)
    : h("img", { class: "preview", src: url, alt: "the exported picture", "data-testid": "export-image" });
  return h("div", { class: "export-result" }, preview,
    h("p", {}, h("a", { href: url, download: name, "data-testid": "export-link" }, `Save ${name}`),
      job.result.path ? h("span", { class: "quiet mono" }, job.result.path) : null));
}

export function export_panel(): HTMLElement {
  const source = h("select", { "data-testid": "export-source", "aria-label": "what to export" });
  const demo = h("select", { "data-testid": "export-demo", "aria-label": "demonstration" });
  const camera = h("select", { "data-testid": "export-camera", "aria-label": "camera" });
  const width = number_input("export-width", "width", 1280, { min: 16, max: 3840, step: 2 });
  const height = number_input("export-height", "height", 960, { min: 16, max: 3840, step: 2 });
  const detectors = h("input", { type: "checkbox", "data-testid": "export-detectors" });
  const about = h("p", { class: "quiet" });
  const demo_field = field("demonstration", demo);
  const job = job_view("export-job", finished);

  const request = (kind: Kind): ExportOptions => {
    const { trace, step } = store.state;
    const what = source.value as Source;
    return {
      kind, width: read_number(width), height: read_number(height),
      ...(detectors.checked && (kind === "png" || kind === "mp4") ? { detectors: true } : {}),
      ...(camera.value ? { camera: camera.value } : {}),
      ...(what === "trace" && trace ? { trace: trace.id, ...(kind === "png" ? { step } : {}) } : {}),
      ...(what === "demo" ? { demo: demo.value } : {}),
    };
  };
  const start = (kind: Kind, button: HTMLButtonElement) => act(async () => {
    const id = await api.export_media(request(kind));
    job.follow(id);
    await job_over(id);
  }, button);
  const png = h("button", { type: "button", class: "primary", "data-testid": "export-png", onclick: () => void start("png", png) }, "Picture (PNG)");
  const mp4 = h("button", { type: "button", class: "primary", "data-testid": "export-mp4", onclick: () => void start("mp4", mp4) }, "Film (MP4)");

  const strip = h("button", { type: "button", "data-testid": "export-strip", onclick: () => void start("strip", strip) }, "Strip (PNG)");
  const cloud = h("button", { type: "button", "data-testid": "export-cloud", onclick: () => void start("cloud", cloud) }, "Cloud (PLY)");

  const draw = () => {
    const { trace, demos, step } = store.state;
    const sources = [
      { value: "view", text: "the scene as it is now" },
      ...(trace ? [{ value: "trace", text: `the shown trace ${trace.id}` }] : []),
      ...(demos && demos.length > 0 ? [{ value: "demo", text: "a demonstration" }] : []),
    ];
    const chosen = sources.some((s) => s.value === source.value) ? source.value : "view";
    set_options(source, sources, chosen);
    const ids = (demos ?? []).map((d) => ({ value: d.id, text: `${d.id}: ${d.instruction}` })).reverse();
    set_options(demo, ids, ids.some((d) => d.value === demo.value) ? demo.value : (ids[0]?.value ?? ""));
    demo_field.hidden = chosen !== "demo";
    png.disabled = chosen === "demo";
    mp4.disabled = chosen === "view";
    strip.disabled = chosen !== "trace";
    set_text(about, {
      view: "A picture of the scene as the camera sees it now, without a trace. A film needs a trace or a demonstration.",
      trace: `Picture: step ${step} with everything drawn in it. Film: all steps from noise to action. Strip: all of them side by side.`,
      demo: "A film of the whole demonstration.",
    }[chosen as Source]);
  };
  source.addEventListener("change", draw);
  store.watch((s) => [s.trace, s.demos, s.step] as const, draw);
  store.watch((s) => [s.trace?.id] as const, (id) => {
    if (id) source.value = "trace";
    draw();
  });
  store.watch((s) => [s.snapshot?.cameras.join("\n") ?? ""] as const, (names) => {
    const cameras = names === "" ? [] : names.split("\n");
    set_options(camera, [{ value: "", text: "as in the live view" }, ...cameras.map((name) => ({ value: name, text: name.replaceAll("_", " ") }))], camera.value);
  });
  const result = h("div", { class: "grow" });
  fill(result, job.element);
  return h("div", { class: "panel export-panel" }, h("h2", {}, "Export"),
    h("div", { class: "row wrap" }, field("what", source), demo_field),
    h("div", { class: "row wrap" }, field("camera", camera), field("width", width, "px"), field("height", height, "px")),
    h("label", { class: "check", title: "draw the volumes and ways that success terms watch into pictures and films" }, detectors, "detectors"),
    about, h("div", { class: "row" }, png, mp4, strip, cloud), result);
}
