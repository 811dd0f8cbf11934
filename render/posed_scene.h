// A model with one SceneState applied: everything a picture depends on except the camera. Internal to
// render/.
#pragma once

#include <string>

#include "render/camera_model.h"
#include "render/mujoco_handles.h"
#include "render/scene_state.h"

namespace flowscope {

/// Own copies of model and data; the caller may go on changing its own.
class PosedScene {
 public:
  PosedScene(const mjModel* model, std::string scene);

  /// Throws std::invalid_argument when the state is of another scene, has another size or is not finite.
  void apply(const SceneState& state);
  /// A camera of the scene file at its present pose; throws std::invalid_argument with the known names.
  CameraModel camera(const std::string& name, int width, int height) const;

  mjModel* model() { return model_.get(); }
  mjData* data() { return data_.get(); }

 private:
  void check(const SceneState& state) const;

  std::string scene_;
  ModelPtr model_;
  DataPtr data_;
};

}  // namespace flowscope
