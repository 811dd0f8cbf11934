#include "app/export_media.h"

#include "app/render_loop.h"
#include "app/trace_overlay.h"
#include "render/encode.h"

namespace flowscope {

namespace {
RendererOptions options_for(const web::ViewSettings& view) {
  RendererOptions options;
  options.max_width = view.width;
  options.max_height = view.height;
  options.samples = 4;  // a figure is looked at for longer than a frame of a stream
  return options;
}

/// Whoever cancels gets the reason, and Mp4Writer leaves no file.
void stop_if_asked(const std::stop_token& stop) {
  if (stop.stop_requested()) throw web::ApiError(409, "cancelled", "the export was cancelled");
}
}  // namespace

void export_png(const TaskLibrary& tasks, const SceneState& state, const web::ViewSettings& view,
                const Overlay& overlay, const std::filesystem::path& file) {
  Renderer renderer(tasks.get(state.scene)->model(), state.scene, options_for(view));
  write_png(file,
            renderer.draw(state, view_camera(renderer, state, view), view.overlays ? overlay : Overlay{}));
}

void export_trace_mp4(const TaskLibrary& tasks, const SceneState& state, const FlowTrace& trace,
                      const web::ViewSettings& view, const std::filesystem::path& file,
                      const Progress& progress, std::stop_token stop) {
  Renderer renderer(tasks.get(state.scene)->model(), state.scene, options_for(view));
  constexpr double fps = 30;
  Mp4Writer film(file, view.width, view.height, fps);
  const int steps = static_cast<int>(trace.steps.size());
  const CameraModel camera = view_camera(renderer, state, view);
  for (int k = 0; k < steps; ++k) {
    stop_if_asked(stop);
    const ImageRgb picture = renderer.draw(state, camera, overlay_of(trace, k));
    const int repeats = static_cast<int>(fps * (k + 1 == steps ? 1.5 : 0.5));
    for (int i = 0; i < repeats; ++i) film.add(picture);
    progress(double(k + 1) / steps);
  }
  film.finish();
}

void export_demo_mp4(const TaskLibrary& tasks, const Demo& demo, const web::ViewSettings& view,
                     const std::filesystem::path& file, const Progress& progress, std::stop_token stop) {
  Renderer renderer(tasks.get(demo.info.task)->model(), demo.info.task, options_for(view));
  Mp4Writer film(file, view.width, view.height, 20);
  for (std::size_t i = 0; i < demo.frames.size(); ++i) {
    stop_if_asked(stop);
    const SceneState& state = demo.frames[i].state;
    film.add(renderer.draw(state, view_camera(renderer, state, view)));
    progress(double(i + 1) / demo.frames.size());
  }
  film.finish();
}

}  // namespace flowscope
