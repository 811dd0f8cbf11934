// Off-screen pictures of a scene state.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "render/observation.h"
#include "render/overlay.h"
#include "render/scene_state.h"

struct mjModel_;

namespace flowscope {

struct GripperShape;

struct RendererOptions {
  int max_width = 1280, max_height = 960;         ///< off-screen buffer, pixels; larger requests throw
  int samples = 0;                                ///< multisampling; 0 is two times faster on software GL
  bool shadows = true;                            ///< one 1024 shadow map
  std::shared_ptr<const GripperShape> gripper{};  ///< what ghosts look like; null: two plain fingers
  /// > 0: draw() makes pictures in squares of this side, pixels, and the buffer is no larger than one.
  int part = 0;
  /// Called before every part and layer of a picture; what it throws ends the drawing.
  std::function<void()> before_part{};
};

/// Which EGL device was taken and who draws; throws std::runtime_error with what was tried when none works.
struct EglInfo {
  std::string platform;  ///< "device 0", "surfaceless", …
  std::string renderer, vendor, version;
};
/// Opens and closes a context on a thread of its own.
EglInfo probe_egl();

/// Owns an EGL context, MuJoCo's GL context and its own mjData. Create, use and destroy on ONE thread
/// (asserted). The model is copied, so the caller may go on changing its own; a SceneState of another scene
/// or size throws std::invalid_argument.
class Renderer {
 public:
  Renderer(const mjModel_* model, const std::string& scene, const RendererOptions& options = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Picture of `state` through `camera` (its width and height decide the size), overlay drawn in 3-D.
  ImageRgb draw(const SceneState& state, const CameraModel& camera, const Overlay& overlay = {});
  /// RGB and metric depth without overlays: what a policy sees; no larger than one part.
  View observe(const SceneState& state, const CameraModel& camera);
  /// A camera of the scene file by name, at the pose it has in `state` (a wrist camera moves), at a given
  /// size.
  CameraModel camera(const SceneState& state, const std::string& name, int width, int height);
  /// The named cameras at size x size: one Observation.
  Observation observe_all(const SceneState& state, const std::vector<std::string>& cameras, int size);
  EglInfo info() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope
