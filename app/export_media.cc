#include "app/export_media.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <optional>
#include <stdexcept>

#include "app/detector_overlay.h"
#include "app/render_loop.h"
#include "app/trace_overlay.h"
#include "recorder/gripper_shape.h"
#include "render/cloud.h"
#include "render/encode.h"
#include "render/strip.h"

namespace flowscope {

namespace {

constexpr int strip_columns = 5, part_side = 640;         // pictures in a row; pixels
const Box workspace{{-0.3, -0.5, 0.6}, {0.7, 0.5, 1.6}};  // the benchmark's

/// Whoever cancels gets the reason, and no writer leaves a file.
void stop_if_asked(const std::stop_token& stop) {
  if (stop.stop_requested()) throw web::ApiError(409, "cancelled", "the export was cancelled");
}

/// Parts bound both the memory of a large picture and the time until a wish to stop is seen.
RendererOptions options_for(const Task& task, const web::ViewSettings& view, const std::stop_token& stop) {
  RendererOptions options;
  options.gripper = gripper_shape(task.model(), task.robot());
  options.max_width = view.width;
  options.max_height = view.height;
  options.samples = 4;  // a figure is looked at for longer than a frame of a stream
  options.part = part_side;
  options.before_part = [stop] { stop_if_asked(stop); };
  return options;
}

PointCloud cloud_of(const TaskLibrary& tasks, const SceneState& state, const std::stop_token& stop) {
  stop_if_asked(stop);
  const auto task = tasks.get(state.scene);
  RendererOptions options;
  options.before_part = [stop] { stop_if_asked(stop); };
  Renderer renderer(task->model(), state.scene, options);
  return to_point_cloud(renderer.observe_all(state, observation_cameras(task->model()), observation_size),
                        workspace);
}

std::string caption_of(const FlowStep& step) {
  char text[80];
  std::snprintf(text, sizeof text, "t = %.2f   r = %.3f m   %d points", step.t, step.region.radius_m,
                step.region.points);
  return text;
}

}  // namespace

void export_png(const TaskLibrary& tasks, const SceneState& state, const web::ViewSettings& view,
                const Overlay& overlay, const std::filesystem::path& file, std::stop_token stop) {
  stop_if_asked(stop);
  const auto task = tasks.get(state.scene);
  Renderer renderer(task->model(), state.scene, options_for(*task, view, stop));
  const ImageRgb picture =
      renderer.draw(state, view_camera(renderer, state, view), view.overlays ? overlay : Overlay{});
  write_png(file, picture, [&] { stop_if_asked(stop); });
}

void export_trace_mp4(const TaskLibrary& tasks, const SceneState& state, const FlowTrace& trace,
                      const web::ViewSettings& view, const std::filesystem::path& file,
                      const Progress& progress, std::stop_token stop) {
  const auto task = tasks.get(state.scene);
  Renderer renderer(task->model(), state.scene, options_for(*task, view, stop));
  constexpr double fps = 30;
  Mp4Writer film(file, view.width, view.height, fps, stop);
  const int steps = static_cast<int>(trace.steps.size());
  const CameraModel camera = view_camera(renderer, state, view);
  const Overlay detectors = view.detectors ? detectors_of(tasks, trace, state) : Overlay{};
  for (int k = 0; k < steps; ++k) {
    stop_if_asked(stop);
    const ImageRgb picture = renderer.draw(state, camera, together(overlay_of(trace, k), detectors));
    const int repeats = static_cast<int>(fps * (k + 1 == steps ? 1.5 : 0.5));
    for (int i = 0; i < repeats; ++i) film.add(picture);
    progress(double(k + 1) / steps);
  }
  film.finish();
}

void export_demo_mp4(const TaskLibrary& tasks, const Demo& demo, const web::ViewSettings& view,
                     const std::filesystem::path& file, const Progress& progress, std::stop_token stop) {
  const auto task = tasks.get(demo.info.task);
  Renderer renderer(task->model(), demo.info.task, options_for(*task, view, stop));
  Mp4Writer film(file, view.width, view.height, 20, stop);
  std::optional<DetectorReplay> detectors;
  if (view.detectors) detectors.emplace(task, demo.info.variation, demo.info.seed);
  for (std::size_t i = 0; i < demo.frames.size(); ++i) {
    stop_if_asked(stop);
    const SceneState& state = demo.frames[i].state;
    const Overlay overlay = detectors ? detectors->at(state) : Overlay{};
    film.add(renderer.draw(state, view_camera(renderer, state, view), overlay));
    progress(double(i + 1) / demo.frames.size());
  }
  film.finish();
}

void export_strip(const TaskLibrary& tasks, const SceneState& state, const FlowTrace& trace,
                  const web::ViewSettings& view, const std::filesystem::path& file, std::stop_token stop) {
  if (trace.steps.size() > strip_most_steps) {
    throw std::invalid_argument("a strip shows at most " + std::to_string(strip_most_steps) +
                                " states of a flow, this one has " + std::to_string(trace.steps.size()) +
                                ": predict with fewer steps, or make a film");
  }
  const auto task = tasks.get(state.scene);
  Renderer renderer(task->model(), state.scene, options_for(*task, view, stop));
  const CameraModel camera = view_camera(renderer, state, view);
  std::vector<StripPanel> panels;
  for (std::size_t k = 0; k < trace.steps.size(); ++k) {
    stop_if_asked(stop);
    panels.push_back(
        {renderer.draw(state, camera, overlay_of(trace, static_cast<int>(k))), caption_of(trace.steps[k])});
  }
  StripStyle style;
  style.height = view.height;
  style.columns = std::min(static_cast<int>(panels.size()), strip_columns);
  write_png(file, compose_strip(panels, style), [&] { stop_if_asked(stop); });
}

void find_points_inside(const TaskLibrary& tasks, const SceneState& state, FlowTrace& trace) {
  const PointCloud cloud = voxel_grid(cloud_of(tasks, state, {}), 0.01);
  for (FlowStep& step : trace.steps) {
    const Eigen::Vector3f center = step.region.center.cast<float>();
    const auto radius = static_cast<float>(step.region.radius_m);
    step.region.inside.clear();
    std::ranges::copy_if(cloud.position, std::back_inserter(step.region.inside),
                         [&](const auto& p) { return (p - center).norm() <= radius; });
  }
}

void export_cloud(const TaskLibrary& tasks, const SceneState& state, double leaf_m,
                  const std::filesystem::path& file, std::stop_token stop) {
  const PointCloud all = cloud_of(tasks, state, stop);
  stop_if_asked(stop);
  write_cloud(file, leaf_m > 0 ? voxel_grid(all, leaf_m) : all);
}

}  // namespace flowscope
