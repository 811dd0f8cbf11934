// Studio: execution, exports, demonstrations, pictures.
#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "app/detector_overlay.h"
#include "app/export_media.h"
#include "app/studio.h"
#include "app/trace_overlay.h"
#include "recorder/utc_time.h"
#include "render/encode.h"

namespace flowscope {

using web::ApiError;
using web::JobStatus;
using web::ViewSettings;

std::string Studio::execute_trace(const std::string& id) {
  const auto stored = traces_.get(id);
  if (stored->episode != scene()->episode) {
    throw ApiError(409, "other_scene", "that prediction was made in a scene that has been reset since");
  }
  show_failure({}, "");
  render_.unpin();  // the living scene from now on, with the prediction still drawn
  return start_motion("execute", [this, stored](JobBoard::Handle& handle) {
    handle.update([](JobStatus& s) { s.message = "moving to the predicted keyframe"; });
    MotionResult result;
    try {
      result = sim_.execute(stored->trace.result, stored->trace.seed, stored->episode, handle.stop()).get();
    } catch (const SimLoop::SceneChanged& error) {
      throw ApiError(409, "other_scene", error.what());
    }
    const auto after = scene();
    if (!result && !after->success && !handle.stop().stop_requested())
      show_failure(result.world_from_tool, result.message);
    if (!result && !after->success) throw ApiError(422, to_string(result.failure), result.message);
    handle.update([&](JobStatus& s) {
      s.success = after->success;
      s.message = after->success ? "the task succeeded" : "arrived; predicting the next keyframe";
      s.progress = 0.8;
    });
    if (after->success || handle.stop().stop_requested()) return;
    web::PredictRequest next;
    next.flow_steps = stored->trace.flow_steps;
    next.seed = stored->trace.seed;
    const auto ids = predict_until(next, handle.stop());
    show_trace(ids.front(), next.flow_steps);
    handle.update([&](JobStatus& s) { s.message = "arrived; the next prediction is " + ids.front(); });
  });
}

std::string Studio::export_media(const web::ExportRequest& request) {
  const std::map<std::string, std::string> endings{
      {"png", ".png"}, {"mp4", ".mp4"}, {"strip", ".png"}, {"cloud", ".ply"}};
  const auto ending = endings.find(request.kind);
  if (ending == endings.end()) throw ApiError(400, "bad_kind", "kind is png, mp4, strip or cloud", "kind");
  ViewSettings view = render_.view("main");
  if (!request.camera.empty())
    view.camera = request.camera == "free" ? std::nullopt : std::optional(request.camera);
  const auto known = observation_cameras(tasks_.get(scene()->task)->model());
  if (view.camera && std::ranges::find(known, *view.camera) == known.end()) {
    throw ApiError(400, "unknown_camera", "there is no camera " + *view.camera, "camera");
  }
  view.width = request.width;
  view.height = request.height;
  view.overlays = true;
  view.detectors = request.detectors;
  if (view.width < 64 || view.height < 64 || view.width > 3840 || view.height > 2160) {
    throw ApiError(400, "bad_size", "an export is 64x64 to 3840x2160 pixels", "width");
  }
  std::shared_ptr<const StoredTrace> stored;
  if (!request.trace.empty()) stored = traces_.get(request.trace);
  if (!request.demo.empty()) {
    const auto all = demos_.list();
    if (std::ranges::find(all, request.demo, &DemoInfo::id) == all.end()) {
      throw ApiError(404, "not_found", "there is no demonstration " + request.demo);
    }
  } else if (request.kind == "mp4" && !stored) {
    throw ApiError(400, "nothing_to_film", "an MP4 needs a trace or a demo", "trace");
  }
  if (request.kind == "strip" && !stored)
    throw ApiError(400, "nothing_to_show", "a strip shows the steps of a trace", "trace");
  if (request.kind == "strip" && stored->trace.steps.size() > strip_most_steps) {
    throw ApiError(400, "too_many_steps",
                   "a strip shows at most " + std::to_string(strip_most_steps) +
                       " states of a flow: predict with fewer steps, or make an mp4",
                   "trace");
  }
  if (request.kind == "strip")
    view.width = std::min(view.width, 640), view.height = std::min(view.height, 480);
  const std::string subject = !request.demo.empty() ? request.demo : stored ? stored->trace.id : "scene";
  const std::string name =
      utc_now().substr(0, 10) + "-" + subject + "-" + std::to_string(next_export_++) + ending->second;
  const auto path = options_.data / "exports" / name;
  const auto now = scene();  // what is drawn is what there was when it was asked for, however long it waits
  const bool of_scene = request.kind == "png" && !stored && request.demo.empty();
  const Overlay layers = of_scene ? render_.overlay(view) : Overlay{};
  return jobs_.start(JobLane::exports, "export", [=, this](JobBoard::Handle& handle) {
    handle.update([&](JobStatus& s) { s.message = "drawing " + name; });
    auto progress = [&](double done) { handle.update([&](JobStatus& s) { s.progress = done; }); };
    const auto still = [&] {
      if (stored) return stored->state;
      return request.demo.empty() ? now->state : demos_.load(request.demo).frames.back().state;
    };
    if (request.kind == "png" && stored) {
      Overlay overlay = overlay_of(stored->trace, request.step.value_or(stored->trace.flow_steps));
      if (view.detectors) overlay = together(overlay, detectors_of(tasks_, stored->trace, stored->state));
      export_png(tasks_, stored->state, view, overlay, path, handle.stop());
    } else if (request.kind == "png" && !request.demo.empty()) {
      const Demo demo = demos_.load(request.demo);
      const Overlay overlay = view.detectors ? detectors_of(tasks_, demo, demo.frames.size() - 1) : Overlay{};
      export_png(tasks_, demo.frames.back().state, view, overlay, path, handle.stop());
    } else if (request.kind == "png") {
      export_png(tasks_, now->state, view, layers, path, handle.stop());
    } else if (request.kind == "strip") {
      export_strip(tasks_, still(), stored->trace, view, path, handle.stop());
    } else if (request.kind == "cloud") {
      export_cloud(tasks_, still(), 0, path, handle.stop());
    } else if (stored) {
      export_trace_mp4(tasks_, stored->state, stored->trace, view, path, progress, handle.stop());
    } else {
      export_demo_mp4(tasks_, demos_.load(request.demo), view, path, progress, handle.stop());
    }
    const bool wanted = handle.update([&](JobStatus& s) {
      s.url = "/exports/" + name;
      s.path = path.string();
      s.message = "wrote " + name;
      s.success = true;
    });
    if (!wanted) std::filesystem::remove(path);
  });
}

std::string Studio::export_file(const std::string& name) {
  const bool plain = std::ranges::all_of(
      name, [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_' || c == '.'; });
  const auto path = options_.data / "exports" / name;
  if (!plain || name.starts_with(".") || !std::filesystem::is_regular_file(path)) {
    throw ApiError(404, "not_found", "there is no such export");
  }
  return path.string();
}

std::vector<DemoInfo> Studio::demos() { return demos_.list(); }

Demo Studio::demo(const std::string& id) {
  try {
    return demos_.load_keyframes(id);
  } catch (const std::out_of_range& error) {
    throw ApiError(404, "not_found", error.what());
  }
}

std::vector<std::uint8_t> Studio::demo_picture(const std::string& id, int keyframe,
                                               const std::string& camera) {
  const Demo d = demo(id);
  if (keyframe < -1 || keyframe >= static_cast<int>(d.keyframes.size())) {
    throw ApiError(404, "not_found",
                   "keyframes run from -1 (the start) to " + std::to_string(d.keyframes.size() - 1));
  }
  const Observation& seen = keyframe < 0 ? d.start : d.keyframes[keyframe].observation;
  for (const auto& view : seen.views)
    if (view.camera.name == camera) return encode_png(view.rgb);
  throw ApiError(404, "not_found", "there is no camera " + camera);
}

void Studio::remove_demo(const std::string& id) {
  try {
    demos_.remove(id);
  } catch (const std::out_of_range& error) {
    throw ApiError(404, "not_found", error.what());
  }
  policy_.demo_removed(id);
}

std::vector<std::uint8_t> Studio::snapshot(const web::SnapshotRequest& request) {
  ViewSettings view = render_.view(request.view);
  if (request.width > 0) view.width = request.width;
  if (request.height > 0) view.height = request.height;
  const RendererOptions limits;
  if (view.width < 16 || view.height < 16 || view.width > limits.max_width ||
      view.height > limits.max_height) {
    throw ApiError(400, "bad_size", "a snapshot is 16x16 to 1280x960 pixels", "width");
  }
  const auto pinned = render_.pinned();
  const ImageRgb picture = render_.draw(pinned ? *pinned : scene()->state, view, render_.overlay(view)).get();
  if (request.format == "png") return encode_png(picture);
  return JpegEncoder().encode(picture);
}

}  // namespace flowscope
