// The thread that owns the EGL context, and the one that owns the JPEG compressor.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "app/job_queue.h"
#include "app/latest.h"
#include "app/overlay_layers.h"
#include "app/sim_loop.h"
#include "render/renderer.h"
#include "web/backend.h"
#include "web/frame.h"

namespace flowscope {

/// A drawn picture on its way to the compressor.
struct Picture {
  ImageRgb image;
  double timestamp_s = 0;
};

/// Turns the newest picture of each view into one JPEG that all its viewers share.
class EncodeLoop {
 public:
  using Publish = std::function<void(const std::string& view, web::FramePtr)>;
  explicit EncodeLoop(Publish publish);
  ~EncodeLoop();
  void offer(const std::string& view, Picture picture);
  std::uint64_t encoded() const { return encoded_; }

 private:
  void run(std::stop_token stop);
  Publish publish_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Picture> waiting_;
  std::atomic<std::uint64_t> encoded_{0};
  std::jthread thread_;
};

/// Draws views that somebody watches, when something in them changed; answers requests for observations and
/// pictures. Public methods: any thread. Without EGL the program goes on: every request fails with the
/// reason, which failure() names.
class RenderLoop {
 public:
  RenderLoop(const TaskLibrary& tasks, const Latest<SimSnapshot>& sim, EncodeLoop& encode);
  ~RenderLoop();

  std::future<Observation> observe(SceneState state);
  /// Draws any state as a view would show it.
  std::future<ImageRgb> draw(SceneState state, web::ViewSettings view, Overlay overlay);
  /// The camera of such a picture.
  std::future<CameraModel> camera(SceneState state, web::ViewSettings view);
  void set_view(const web::ViewSettings& view);         ///< adds or changes
  web::ViewSettings view(const std::string& id) const;  ///< throws web::ApiError 404
  std::vector<web::ViewSettings> views() const;
  void set_viewers(const std::string& view, int viewers);
  int viewers() const;
  /// Draws `overlay` over every view from now on, together with the other layers; an empty one takes the
  /// layer away.
  void show(const std::string& layer, Overlay overlay);
  /// The same, and shows `state` instead of the living one (a trace of a scene that has moved on); null: the
  /// living one again.
  void show(const std::string& layer, Overlay overlay, std::shared_ptr<const SceneState> state);
  /// Shows the living scene again; the layers stay.
  void unpin();
  /// What the view shows over the living scene or over the one that is pinned: all layers, and the detectors
  /// of the living one.
  Overlay overlay(const web::ViewSettings& view) const;
  std::shared_ptr<const SceneState> pinned() const;
  void wake() { queue_.poke(); }
  std::uint64_t rendered() const { return rendered_; }
  std::string failure() const;
  /// The renderer's name once a scene has been drawn.
  EglInfo info() const;

 private:
  struct Room {
    std::unique_ptr<Renderer> renderer;
    std::string scene;
  };
  struct Seen {
    web::ViewSettings settings;
    int viewers = 0;
    std::uint64_t version = 1, drawn = 0;  ///< counts changes of settings, overlay or viewers
    std::uint64_t sim_drawn = 0;
  };
  Renderer& renderer(Room& room, const std::string& scene);
  ImageRgb draw_now(Room& room, const SceneState& state, const web::ViewSettings& view,
                    const Overlay& overlay);
  /// Before anybody watches, so that the first picture comes soon and a machine that cannot draw says so at
  /// the start.
  void open_first_scene(Room& room, const std::string& scene);
  void draw_changed_views(Room& room);
  static Overlay overlay_for(const web::ViewSettings& view, OverlayLayers layers, const SimSnapshot* living);
  /// Under the lock, after a change of layers or of what is pinned.
  void redraw();

  const TaskLibrary& tasks_;
  const Latest<SimSnapshot>& sim_;
  EncodeLoop& encode_;
  mutable std::mutex mutex_;
  std::map<std::string, Seen> views_;
  OverlayLayers layers_;
  std::shared_ptr<const SceneState> pinned_;
  std::string failure_;
  EglInfo info_;
  std::atomic<std::uint64_t> rendered_{0};
  JobQueue<Room> queue_;
  std::jthread thread_;
};

/// The camera that a view's settings mean, for a state.
CameraModel view_camera(Renderer& renderer, const SceneState& state, const web::ViewSettings& view);

}  // namespace flowscope
