// Owners for MuJoCo's drawing objects. For sources only: public headers stay free of MuJoCo.
#pragma once

#include <mujoco/mujoco.h>

#include "render/mujoco_owners.h"

namespace flowscope {

/// Geoms, lights and camera of one picture. Neither copied nor moved: it is 20 kB of arrays.
struct VisualScene {
  VisualScene(const mjModel* model, int max_geoms) {
    mjv_defaultScene(&scene);
    mjv_makeScene(model, &scene, max_geoms);
  }
  ~VisualScene() { mjv_freeScene(&scene); }
  VisualScene(const VisualScene&) = delete;
  VisualScene& operator=(const VisualScene&) = delete;

  mjvScene scene;
};

/// What MuJoCo keeps on the GL side. The GL context must be current when it is made and destroyed.
struct DrawContext {
  explicit DrawContext(const mjModel* model) {
    mjr_defaultContext(&context);
    mjr_makeContext(model, &context, mjFONTSCALE_100);
  }
  ~DrawContext() { mjr_freeContext(&context); }
  DrawContext(const DrawContext&) = delete;
  DrawContext& operator=(const DrawContext&) = delete;

  mjrContext context;
};

}  // namespace flowscope
