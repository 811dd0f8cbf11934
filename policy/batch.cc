#include "policy/batch.h"

#include <algorithm>

namespace flowscope {
namespace {

using Eigen::Vector3f;

constexpr float reach_m = 0.3f;  // unit of the network's isotropic coordinates

// Writes consecutive numbers into a contiguous tensor.
class Writer {
 public:
  explicit Writer(torch::Tensor& tensor) : at_(tensor.data_ptr<float>()) {}
  void put(float v) { *at_++ = v; }
  void put(const Vector3f& v) { put(v.x()), put(v.y()), put(v.z()); }

 private:
  float* at_;
};

struct ToolView {
  Vector3f position, center;
  Eigen::Matrix3f tool_from_world;
  float plane_z;
};

ToolView tool_view(const SceneInput& s, const PositionScale& scale) {
  const Pose& tool = s.history.back().world_from_tool;
  return {tool.position.cast<float>(), scale.center.cast<float>(),
          tool.rotation.toRotationMatrix().transpose().cast<float>(), s.scene->plane_z};
}

void put_point(Writer& w, const ScenePoint& p, const ToolView& v) {
  const Vector3f to_tool = (p.position - v.position) / reach_m;
  w.put(Vector3f((p.position - v.center) / reach_m));
  w.put(to_tool);
  w.put(Vector3f(v.tool_from_world * to_tool));
  w.put(p.normal);
  w.put(Vector3f(v.tool_from_world * p.normal));
  w.put(p.color);
  w.put(std::clamp((p.position.z() - v.plane_z) * 20.f, -3.f, 6.f));
  w.put(std::clamp((p.position.z() - v.plane_z) * 100.f, -2.f, 2.f));
  w.put(Vector3f((p.around.middle - p.position) / 0.05f));
  w.put(std::log1p(static_cast<float>(p.around.neighbours)) / 4.f);
  w.put(p.around.square.norm());
  w.put(p.around.bar.norm());
}

void put_moments(Writer& w, const ScenePoint& p) {
  for (const float v : {p.around.square.x(), p.around.square.y(), p.around.bar.x(), p.around.bar.y()})
    w.put(v);
}

torch::Tensor as_planes(const ImageRgb& picture) {
  return torch::from_blob(const_cast<std::uint8_t*>(picture.data.data()), {picture.height, picture.width, 3},
                          torch::kUInt8)
             .permute({2, 0, 1})
             .to(torch::kFloat32) /
         255;
}

// What frozen encoders look at or have said.
void put_frozen(SceneBatch& b, const std::vector<const SceneInput*>& scenes, const NetworkShape& shape) {
  const auto s_count = static_cast<std::int64_t>(scenes.size());
  if (const auto& first = scenes.front()->words.front().feature) {
    const auto width = static_cast<std::int64_t>(first->size());
    b.word_feature = torch::zeros({s_count, shape.words, width});
    for (std::int64_t s = 0; s < s_count; ++s) {
      const auto& words = scenes[static_cast<std::size_t>(s)]->words;
      for (std::size_t w = 0; w < std::min(words.size(), static_cast<std::size_t>(shape.words)); ++w)
        std::ranges::copy(*words[w].feature, b.word_feature.data_ptr<float>() +
                                                 (s * shape.words + static_cast<std::int64_t>(w)) * width);
    }
  }
  if (!scenes.front()->scene->pictures) return;
  std::vector<torch::Tensor> pictures;
  b.patch_place = torch::empty({s_count, shape.image_tokens, 3});
  Writer place(b.patch_place);
  for (const SceneInput* in : scenes) {
    for (const ImageRgb& picture : *in->scene->pictures) pictures.push_back(as_planes(picture));
    for (std::size_t m = 0; m < static_cast<std::size_t>(shape.image_tokens); ++m)
      place.put(in->scene->patch_place[m % in->scene->patch_place.size()]);
  }
  b.pictures = torch::stack(pictures);
}

}  // namespace

SceneBatch make_scene_batch(const std::vector<const SceneInput*>& scenes, const NetworkShape& shape,
                            const PositionScale& scale) {
  const auto s_count = static_cast<std::int64_t>(scenes.size());
  const std::int64_t words = shape.words, tokens = shape.image_tokens;
  SceneBatch b;
  b.word_row = torch::zeros({s_count, words}, torch::kInt64);
  b.word_mention = torch::zeros({s_count, words}, torch::kInt64);
  b.word_color = torch::zeros({s_count, words, 3});
  b.image_feature = torch::empty({s_count, tokens, point_features});
  b.image_position = torch::empty({s_count, tokens, 3});
  b.image_moments = torch::empty({s_count, tokens, 4});
  b.image_color = torch::empty({s_count, tokens, 3});
  b.patches = torch::empty({s_count, tokens, patch_values});
  b.history = torch::empty({s_count, history_length, history_features});
  b.history_position = torch::empty({s_count, history_length, 3});
  b.tool_axes = torch::empty({s_count, 3, 3});
  b.keyframe_index = torch::empty({s_count}, torch::kInt64);

  put_frozen(b, scenes, shape);
  Writer feature(b.image_feature), position(b.image_position), moments(b.image_moments), color(b.image_color),
      patch(b.patches), history(b.history), history_position(b.history_position), axes(b.tool_axes);
  for (std::int64_t s = 0; s < s_count; ++s) {
    const SceneInput& in = *scenes[static_cast<std::size_t>(s)];
    const ToolView tool = tool_view(in, scale);
    for (std::size_t w = 0; w < std::min(in.words.size(), static_cast<std::size_t>(words)); ++w) {
      const std::int64_t at = s * words + static_cast<std::int64_t>(w);
      b.word_row.data_ptr<std::int64_t>()[at] = in.words[w].row;
      b.word_mention.data_ptr<std::int64_t>()[at] = std::min(in.words[w].mention, 7);
      Eigen::Map<Vector3f>(b.word_color.data_ptr<float>() + 3 * at) = in.words[w].color;
    }
    const PreparedScene& scene = *in.scene;
    for (std::size_t m = 0; m < static_cast<std::size_t>(tokens); ++m) {
      const std::size_t i = m % scene.patches.size();  // a scene of fewer points repeats them
      put_point(feature, scene.points[i], tool);
      position.put(scene.points[i].around.middle);
      put_moments(moments, scene.points[i]);
      color.put(scene.points[i].color);
      for (const float v : scene.patches[i]) patch.put(v);
    }
    for (const RobotState& r : in.history) {
      const Vector3f p = r.world_from_tool.position.cast<float>();
      const Eigen::Matrix<float, 6, 1> rotation = rotation_to_6d(r.world_from_tool.rotation).cast<float>();
      history.put(Vector3f((p - tool.center) / reach_m));
      for (int k = 0; k < 6; ++k) history.put(rotation[k]);
      history.put(static_cast<float>(r.openness));
      for (const double q : r.q) history.put(static_cast<float>(0.3 * q));
      history_position.put(p);
    }
    for (int a = 0; a < 3; ++a) axes.put(Vector3f(tool.tool_from_world.row(a)));
    b.keyframe_index.data_ptr<std::int64_t>()[s] = std::min(in.keyframe_index, keyframe_rows - 1);
  }
  return b;
}

DrawBatch make_draw_batch(const std::vector<const SceneInput*>& scenes, const std::vector<Draw>& draws,
                          const NetworkShape& shape, const PositionScale& scale,
                          std::vector<RegionPoints>* regions) {
  const auto count = static_cast<std::int64_t>(draws.size());
  const std::int64_t n = shape.region_points;
  const std::size_t per_scene = draws.size() / scenes.size();
  DrawBatch b{.x = torch::empty({count, 9}),
              .t = torch::empty({count}),
              .region_feature = torch::empty({count, n, region_features}),
              .region_position = torch::empty({count, n, 3}),
              .region_place = torch::empty({count, n, 3}),
              .region_moments = torch::empty({count, n, 4}),
              .region_color = torch::empty({count, n, 3})};
  Writer x(b.x), t(b.t), feature(b.region_feature), position(b.region_position), place(b.region_place),
      moments(b.region_moments), color(b.region_color);
  for (std::size_t d = 0; d < draws.size(); ++d) {
    const SceneInput& in = *scenes[d / per_scene];
    const Draw& draw = draws[d];
    const ToolView tool = tool_view(in, scale);
    const Vector3f center = scale.denormalise(Eigen::Map<const Eigen::Vector3d>(draw.x.data())).cast<float>();
    const auto radius = static_cast<float>(draw.radius_m);
    RegionPoints region = select_region(in.scene->points, center, radius, shape.region_points,
                                        draw.everywhere, sphere_rule(shape));
    for (const double v : draw.x) x.put(static_cast<float>(v));
    t.put(static_cast<float>(draw.t));
    for (std::size_t i = 0; i < region.index.size(); ++i) {
      const ScenePoint& p = in.scene->points[static_cast<std::size_t>(region.index[i])];
      const Vector3f relative = p.position - center;
      put_point(feature, p, tool);
      feature.put(Vector3f((relative / radius).cwiseMax(-3.f).cwiseMin(3.f)));
      feature.put(Vector3f((relative / 0.05f).cwiseMax(-3.f).cwiseMin(3.f)));
      feature.put(std::min(relative.norm() / radius, 3.f));
      feature.put(region.inside[i] ? 1.f : 0.f);
      position.put(p.around.middle);
      place.put(p.position);
      put_moments(moments, p);
      color.put(p.color);
    }
    if (regions) regions->push_back(std::move(region));
  }
  return b;
}

}  // namespace flowscope
