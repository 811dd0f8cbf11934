#include "render/renderer.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "render/egl_context.h"
#include "render/gripper_shape.h"
#include "render/overlay_draw.h"
#include "render/overlay_paint.h"
#include "render/posed_scene.h"

namespace flowscope {

namespace {

mjvOption scene_options() {
  mjvOption option;
  mjv_defaultOption(&option);
  // Groups 0-2 are what stands on the table, 3 and up its collision shapes. Sites name places; they are not
  // things.
  for (int group = 0; group < mjNGROUP; ++group) {
    option.geomgroup[group] = group <= 2;
    option.sitegroup[group] = 0;
  }
  std::fill(std::begin(option.flags), std::end(option.flags), mjtByte{0});
  option.flags[mjVIS_TEXTURE] = option.flags[mjVIS_STATIC] = option.flags[mjVIS_SKIN] = 1;
  return option;
}

mjvGLCamera gl_camera(const CameraModel& camera) {
  const Eigen::Matrix3d world_from_camera = camera.world_from_camera.rotation.toRotationMatrix();
  mjvGLCamera gl{};
  for (int i = 0; i < 3; ++i) {
    gl.pos[i] = static_cast<float>(camera.world_from_camera.position[i]);
    gl.forward[i] = static_cast<float>(world_from_camera(i, 2));
    gl.up[i] = static_cast<float>(-world_from_camera(i, 1));
  }
  // The frustum's cut with the near plane, metres; its width follows from the viewport because pixels are
  // square.
  const double near_m = camera.near_m;
  gl.frustum_top = static_cast<float>(camera.cy / camera.fy * near_m);
  gl.frustum_bottom = static_cast<float>((camera.cy - camera.height) / camera.fy * near_m);
  gl.frustum_center = static_cast<float>((0.5 * camera.width - camera.cx) / camera.fx * near_m);
  gl.frustum_near = static_cast<float>(near_m);
  gl.frustum_far = static_cast<float>(camera.far_m);
  return gl;
}

void check_camera(const CameraModel& camera, const RendererOptions& options) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("camera '" + camera.name + "': " + why);
  };
  if (camera.width <= 0 || camera.height <= 0) refuse("width and height must be positive");
  if (camera.width > options.max_width || camera.height > options.max_height) {
    refuse(std::to_string(camera.width) + "x" + std::to_string(camera.height) + " pixels are more than " +
           std::to_string(options.max_width) + "x" + std::to_string(options.max_height));
  }
  if (!(camera.near_m > 0) || !(camera.far_m > camera.near_m) || !std::isfinite(camera.far_m)) {
    refuse("needs 0 < near < far");
  }
  if (!(camera.fx > 0) || !(std::abs(camera.fx - camera.fy) <= 1e-6 * camera.fx)) {
    refuse("needs square pixels: fx = fy > 0");
  }
  if (!std::isfinite(camera.cx) || !std::isfinite(camera.cy) ||
      !camera.world_from_camera.position.allFinite() ||
      !(std::abs(camera.world_from_camera.rotation.norm() - 1) < 1e-6)) {
    refuse("needs a finite pose with a unit quaternion");
  }
}

/// A piece of a picture and the camera that sees just that.
struct Part {
  int x = 0, y = 0;
  CameraModel camera;
};

std::vector<Part> parts_of(const CameraModel& whole, int side) {
  if (side <= 0) return {{0, 0, whole}};
  std::vector<Part> parts;
  for (int y = 0; y < whole.height; y += side) {
    for (int x = 0; x < whole.width; x += side) {
      Part part{x, y, whole};
      part.camera.width = std::min(side, whole.width - x);
      part.camera.height = std::min(side, whole.height - y);
      part.camera.cx -= x;
      part.camera.cy -= y;
      parts.push_back(std::move(part));
    }
  }
  return parts;
}

void place(const ImageRgb& piece, const Part& part, ImageRgb& picture) {
  for (int y = 0; y < piece.height; ++y)
    std::copy_n(piece.at(0, y), 3 * piece.width, picture.at(part.x, part.y + y));
}

int buffer_side(const RendererOptions& options, int picture_side) {
  return options.part > 0 ? std::min(options.part, picture_side) : picture_side;
}

/// GL rows run bottom to top.
template <typename T>
void flip_rows(std::vector<T>& data, int height) {
  const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(data.size()) / height;
  for (std::ptrdiff_t top = 0, bottom = height - 1; top < bottom; ++top, --bottom) {
    std::swap_ranges(data.begin() + top * stride, data.begin() + (top + 1) * stride,
                     data.begin() + bottom * stride);
  }
}

/// Window depth in [0, 1] to metres along z; 0 where nothing is in front of the far plane.
void to_metres(std::vector<float>& depth, const CameraModel& camera) {
  const double near_m = camera.near_m, far_m = camera.far_m;
  for (float& d : depth) {
    d = d >= 1.0f ? 0.0f : static_cast<float>(near_m * far_m / (far_m - d * (far_m - near_m)));
  }
}

/// Off-screen buffer and quality are read from the model when MuJoCo's GL context is made.
void set_quality(mjModel* model, const RendererOptions& options) {
  if (options.max_width <= 0 || options.max_height <= 0 || options.samples < 0 || options.part < 0) {
    throw std::invalid_argument("renderer: needs positive sizes and samples >= 0");
  }
  model->vis.global.offwidth = buffer_side(options, options.max_width);
  model->vis.global.offheight = buffer_side(options, options.max_height);
  model->vis.quality.offsamples = options.samples;
  model->vis.quality.shadowsize = options.shadows ? 1024 : 0;
}

}  // namespace

struct Renderer::Impl {
  Impl(const mjModel* model, const std::string& scene, const RendererOptions& wanted)
      : options(with_gripper(wanted)),
        posed(prepare(model, scene, wanted)),
        visual(posed.model(), 2 * posed.model()->ngeom + 100),
        solids(posed.model(), overlay_geom_limit),
        drawing(posed.model()) {
    mjr_setBuffer(mjFB_OFFSCREEN, &drawing.context);
    const mjrRect size = mjr_maxViewport(&drawing.context);
    const int width = buffer_side(options, options.max_width),
              height = buffer_side(options, options.max_height);
    if (drawing.context.currentBuffer != mjFB_OFFSCREEN || size.width < width || size.height < height) {
      throw std::runtime_error("renderer: the GL driver offers no off-screen buffer of " +
                               std::to_string(width) + "x" + std::to_string(height));
    }
    visual.scene.flags[mjRND_SHADOW] = options.shadows;
    std::fill(std::begin(solids.scene.flags), std::end(solids.scene.flags), mjtByte{0});
    solids.scene.flags[mjRND_CULL_FACE] = 1;
    solids.scene.nskin = 0;
    light_solids(solids.scene);
  }

  static RendererOptions with_gripper(RendererOptions options) {
    if (!options.gripper) options.gripper = std::make_shared<GripperShape>(plain_gripper());
    return options;
  }

  static PosedScene prepare(const mjModel* model, const std::string& scene, const RendererOptions& options) {
    PosedScene posed(model, scene);
    set_quality(posed.model(), options);
    return posed;
  }

  /// Scene and camera of the next picture; nothing is drawn yet.
  void arrange(const SceneState& state, const CameraModel& camera) {
    check_camera(camera, options);
    egl.make_current();
    posed.apply(state);
    look_through(camera);
    mjvCamera user;
    mjv_defaultCamera(&user);
    user.type = mjCAMERA_USER;
    mjvPerturb no_perturbation;
    mjv_defaultPerturb(&no_perturbation);
    mjv_updateScene(posed.model(), posed.data(), &draw_what, &no_perturbation, &user,
                    mjCAT_STATIC | mjCAT_DYNAMIC, &visual.scene);
  }

  void look_through(const CameraModel& camera) {
    visual.scene.camera[0] = visual.scene.camera[1] = gl_camera(camera);
  }

  View read(const CameraModel& camera, mjvScene& scene) {
    if (options.before_part) options.before_part();
    const mjrRect viewport{0, 0, camera.width, camera.height};
    mjr_render(viewport, &scene, &drawing.context);
    View view{camera, ImageRgb(camera.width, camera.height), DepthImage(camera.width, camera.height)};
    mjr_readPixels(view.rgb.data.data(), view.depth.data.data(), viewport, &drawing.context);
    if (const int error = mjr_getError(); error != 0) {
      throw std::runtime_error("renderer: OpenGL error " + std::to_string(error));
    }
    flip_rows(view.rgb.data, camera.height);
    flip_rows(view.depth.data, camera.height);
    to_metres(view.depth.data, camera);
    return view;
  }

  /// Paints lines, frames and ghosts: one picture of them alone for each opacity, the most opaque last.
  void paint_solids(const Overlay& overlay, View& view) {
    mjvScene& scene = solids.scene;
    scene.ngeom = 0;
    append_solids(overlay, *options.gripper, scene);
    if (scene.ngeom == 0) return;
    scene.camera[0] = scene.camera[1] = visual.scene.camera[0];
    std::map<float, std::vector<mjvGeom>> by_opacity;
    for (int i = 0; i < scene.ngeom; ++i) by_opacity[scene.geoms[i].rgba[3]].push_back(scene.geoms[i]);
    for (auto& [opacity, geoms] : by_opacity) {
      for (mjvGeom& geom : geoms) geom.rgba[3] = 1;
      scene.ngeom = static_cast<int>(geoms.size());
      std::copy(geoms.begin(), geoms.end(), scene.geoms);
      paint_layer(read(view.camera, scene), opacity, view);
    }
  }

  RendererOptions options;
  EglContext egl;
  PosedScene posed;
  VisualScene visual;  ///< what stands in the world
  VisualScene solids;  ///< the overlay's lines, frames and ghosts, drawn without it
  DrawContext drawing;
  mjvOption draw_what = scene_options();
};

Renderer::Renderer(const mjModel_* model, const std::string& scene, const RendererOptions& options)
    : impl_(std::make_unique<Impl>(model, scene, options)) {}

Renderer::~Renderer() {
  if (impl_->egl.on_owner_thread()) impl_->egl.make_current();
}

ImageRgb Renderer::draw(const SceneState& state, const CameraModel& camera, const Overlay& overlay) {
  impl_->arrange(state, camera);
  View picture{camera, ImageRgb(camera.width, camera.height), {}};
  for (const Part& part : parts_of(camera, impl_->options.part)) {
    impl_->look_through(part.camera);
    View view = impl_->read(part.camera, impl_->visual.scene);
    paint_spheres(overlay, view);
    paint_boxes(overlay, view);
    paint_points(overlay, view);
    impl_->paint_solids(overlay, view);
    place(view.rgb, part, picture.rgb);
  }
  paint_labels(overlay, picture);
  return std::move(picture.rgb);
}

View Renderer::observe(const SceneState& state, const CameraModel& camera) {
  if (const int side = impl_->options.part; side > 0 && (camera.width > side || camera.height > side))
    throw std::invalid_argument("camera '" + camera.name + "': larger than one part of the renderer");
  impl_->arrange(state, camera);
  return impl_->read(camera, impl_->visual.scene);
}

CameraModel Renderer::camera(const SceneState& state, const std::string& name, int width, int height) {
  impl_->egl.make_current();
  impl_->posed.apply(state);
  return impl_->posed.camera(name, width, height);
}

Observation Renderer::observe_all(const SceneState& state, const std::vector<std::string>& cameras,
                                  int size) {
  Observation observation;
  for (const std::string& name : cameras) {
    observation.views.push_back(observe(state, camera(state, name, size, size)));
  }
  return observation;
}

EglInfo Renderer::info() const { return impl_->egl.info(); }

}  // namespace flowscope
