#include "app/render_loop.h"

#include <spdlog/spdlog.h>

#include <chrono>

#include "app/detector_overlay.h"
#include "recorder/gripper_shape.h"
#include "recorder/record.h"
#include "render/encode.h"

namespace flowscope {

using web::ApiError;
using web::ViewSettings;

namespace {
double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}
}  // namespace

EncodeLoop::EncodeLoop(Publish publish) : publish_(std::move(publish)) {
  thread_ = std::jthread([this](std::stop_token stop) { run(stop); });
}

EncodeLoop::~EncodeLoop() { thread_.request_stop(); }

void EncodeLoop::offer(const std::string& view, Picture picture) {
  {
    std::lock_guard lock(mutex_);
    waiting_[view] = std::move(picture);
  }
  changed_.notify_one();
}

void EncodeLoop::run(std::stop_token stop) {
  JpegEncoder jpeg;
  std::map<std::string, std::uint64_t> sequence;
  for (;;) {
    std::map<std::string, Picture> pictures;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return !waiting_.empty(); })) return;
      pictures.swap(waiting_);
    }
    for (auto& [view, picture] : pictures) {
      try {
        auto frame = std::make_shared<web::EncodedFrame>();
        frame->jpeg = jpeg.encode(picture.image);
        frame->sequence = ++sequence[view];
        frame->timestamp_s = picture.timestamp_s;
        ++encoded_;
        publish_(view, std::move(frame));
      } catch (const std::exception& error) {
        spdlog::error("encoding view {}: {}", view, error.what());
      }
    }
  }
}

CameraModel view_camera(Renderer& renderer, const SceneState& state, const ViewSettings& view) {
  if (view.camera) return renderer.camera(state, *view.camera, view.width, view.height);
  return view.orbit.model(view.width, view.height);
}

RenderLoop::RenderLoop(const TaskLibrary& tasks, const Latest<SimSnapshot>& sim, EncodeLoop& encode)
    : tasks_(tasks), sim_(sim), encode_(encode) {
  ViewSettings& main = views_["main"].settings;
  main.id = "main";
  main.orbit.distance_m = 1.9;  // the whole arm at rest, and the table
  main.orbit.lookat = {0.1, 0, 1.02};
  thread_ = std::jthread([this] {
    Room room;
    while (queue_.run_next(room, std::chrono::milliseconds(1000))) draw_changed_views(room);
  });
}

RenderLoop::~RenderLoop() { queue_.close(); }

Renderer& RenderLoop::renderer(Room& room, const std::string& scene) {
  if (room.renderer && room.scene == scene) return *room.renderer;
  room.renderer.reset();  // one context at a time
  try {
    const auto task = tasks_.get(scene);
    RendererOptions options;
    options.gripper = gripper_shape(task->model(), task->robot());
    room.renderer = std::make_unique<Renderer>(task->model(), scene, options);
  } catch (const std::exception& error) {
    std::lock_guard lock(mutex_);
    if (failure_ != error.what()) spdlog::error("rendering: {}", error.what());
    failure_ = error.what();
    throw ApiError(503, "cannot_draw", error.what());
  }
  room.scene = scene;
  std::lock_guard lock(mutex_);
  failure_.clear();
  info_ = room.renderer->info();
  return *room.renderer;
}

ImageRgb RenderLoop::draw_now(Room& room, const SceneState& state, const ViewSettings& view,
                              const Overlay& overlay) {
  Renderer& r = renderer(room, state.scene);
  ++rendered_;
  return r.draw(state, view_camera(r, state, view), view.overlays || view.detectors ? overlay : Overlay{});
}

void RenderLoop::open_first_scene(Room& room, const std::string& scene) {
  if (room.renderer || !failure().empty()) return;
  try {
    renderer(room, scene);
  } catch (const std::exception&) {
    // renderer() has kept and logged the reason
  }
}

void RenderLoop::draw_changed_views(Room& room) {
  const std::uint64_t sim_version = sim_.version();
  const auto sim = sim_.get();
  if (!sim) return;
  open_first_scene(room, sim->state.scene);
  std::vector<ViewSettings> todo;
  OverlayLayers layers;
  std::shared_ptr<const SceneState> pinned;
  {
    std::lock_guard lock(mutex_);
    pinned = pinned_;
    for (auto& [id, seen] : views_) {
      if (seen.viewers == 0 || (seen.drawn == seen.version && seen.sim_drawn == sim_version)) continue;
      seen.drawn = seen.version;
      seen.sim_drawn = sim_version;
      todo.push_back(seen.settings);
    }
    if (!todo.empty()) layers = layers_;
  }
  for (const auto& view : todo) {
    try {
      const double taken = unix_time_s();
      const Overlay overlay = overlay_for(view, layers, pinned ? nullptr : sim.get());
      encode_.offer(view.id, {draw_now(room, pinned ? *pinned : sim->state, view, overlay), taken});
    } catch (const std::exception& error) {
      if (failure() != error.what()) spdlog::error("drawing view {}: {}", view.id, error.what());
    }
  }
}

std::future<Observation> RenderLoop::observe(SceneState state) {
  return queue_.post([this, state = std::move(state)](Room& room) {
    const auto cameras = observation_cameras(tasks_.get(state.scene)->model());
    return renderer(room, state.scene).observe_all(state, cameras, observation_size);
  });
}

std::future<ImageRgb> RenderLoop::draw(SceneState state, ViewSettings view, Overlay overlay) {
  return queue_.post([this, state = std::move(state), view = std::move(view), overlay = std::move(overlay)](
                         Room& room) { return draw_now(room, state, view, overlay); });
}

std::future<CameraModel> RenderLoop::camera(SceneState state, ViewSettings view) {
  return queue_.post([this, state = std::move(state), view = std::move(view)](Room& room) {
    return view_camera(renderer(room, state.scene), state, view);
  });
}

void RenderLoop::set_view(const ViewSettings& view) {
  {
    std::lock_guard lock(mutex_);
    Seen& seen = views_[view.id];
    seen.settings = view;
    ++seen.version;
  }
  wake();
}

ViewSettings RenderLoop::view(const std::string& id) const {
  std::lock_guard lock(mutex_);
  const auto it = views_.find(id);
  if (it == views_.end()) throw ApiError(404, "not_found", "there is no view " + id);
  return it->second.settings;
}

std::vector<ViewSettings> RenderLoop::views() const {
  std::lock_guard lock(mutex_);
  std::vector<ViewSettings> result;
  for (const auto& [id, seen] : views_) result.push_back(seen.settings);
  return result;
}

void RenderLoop::set_viewers(const std::string& view, int viewers) {
  {
    std::lock_guard lock(mutex_);
    const auto it = views_.find(view);
    if (it == views_.end()) return;
    it->second.viewers = viewers;
    ++it->second.version;  // a viewer who joins a still scene gets a picture at once
  }
  wake();
}

int RenderLoop::viewers() const {
  std::lock_guard lock(mutex_);
  int sum = 0;
  for (const auto& [id, seen] : views_) sum += seen.viewers;
  return sum;
}

void RenderLoop::redraw() {
  for (auto& [id, seen] : views_) ++seen.version;
}

void RenderLoop::show(const std::string& layer, Overlay overlay) {
  {
    std::lock_guard lock(mutex_);
    layers_.set(layer, std::move(overlay));
    redraw();
  }
  wake();
}

void RenderLoop::show(const std::string& layer, Overlay overlay, std::shared_ptr<const SceneState> state) {
  {
    std::lock_guard lock(mutex_);
    layers_.set(layer, std::move(overlay));
    pinned_ = std::move(state);
    redraw();
  }
  wake();
}

void RenderLoop::unpin() {
  {
    std::lock_guard lock(mutex_);
    pinned_ = nullptr;
    redraw();
  }
  wake();
}

Overlay RenderLoop::overlay_for(const ViewSettings& view, OverlayLayers layers, const SimSnapshot* living) {
  if (!view.overlays) layers = {};
  if (view.detectors && living) layers.set("detectors", overlay_of(living->detectors));
  return layers.all();
}

Overlay RenderLoop::overlay(const ViewSettings& view) const {
  const auto sim = sim_.get();
  std::lock_guard lock(mutex_);
  return overlay_for(view, layers_, pinned_ ? nullptr : sim.get());
}

std::shared_ptr<const SceneState> RenderLoop::pinned() const {
  std::lock_guard lock(mutex_);
  return pinned_;
}

std::string RenderLoop::failure() const {
  std::lock_guard lock(mutex_);
  return failure_;
}

EglInfo RenderLoop::info() const {
  std::lock_guard lock(mutex_);
  return info_;
}

}  // namespace flowscope
