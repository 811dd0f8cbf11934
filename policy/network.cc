#include "policy/network.h"

#include <cmath>
#include <stdexcept>

namespace flowscope {
namespace {

// One row per scene to one row per draw.
torch::Tensor per_draw(const torch::Tensor& x, std::int64_t draws) {
  return draws == 1 ? x : x.repeat_interleave(draws, 0);
}

void require_branches(const NetworkShape& shape, bool has_trunk) {
  if (shape.image_branch != "patches" && shape.image_branch != "clip")
    throw std::invalid_argument("image branch '" + shape.image_branch + "' is neither patches nor clip");
  if (shape.text_branch != "words" && shape.text_branch != "clip")
    throw std::invalid_argument("text branch '" + shape.text_branch + "' is neither words nor clip");
  if ((shape.image_branch == "clip") != has_trunk)
    throw std::invalid_argument(
        "the image branch 'clip' needs CLIP weights with an image trunk (--clip FILE)");
}

constexpr int time_features = 32, clip_text_width = 512;
constexpr std::int64_t world_normal_at = 9;  // place of the normal in the point features

}  // namespace

FlowRamNetworkImpl::FlowRamNetworkImpl(const NetworkShape& shape, const std::string& backbone,
                                       std::shared_ptr<const ClipResNet> trunk)
    : shape_(shape), trunk_(std::move(trunk)) {
  require_branches(shape, trunk_ != nullptr);
  const int c = shape.channels;
  word_table_ = register_module("word_table", torch::nn::Embedding(shape.vocabulary, c));
  mention_table_ = register_module("mention_table", torch::nn::Embedding(8, c));
  place_table_ = register_module("place_table", torch::nn::Embedding(shape.words, c));
  keyframe_table_ = register_module("keyframe_table", torch::nn::Embedding(keyframe_rows, c));
  word_color_ = register_module("word_color", torch::nn::Linear(3, c));
  history_ = register_module("history", Mlp(history_features, c, c));
  proprioception_ = register_module("proprioception", Mlp(history_features * history_length, c, c));
  time_ = register_module("time", Mlp(2 * time_features, c, c));
  if (trunk_)
    clip_image_ = register_module("clip_image", ClipImageBranch(trunk_, c));
  else
    patch_ = register_module("patch", Mlp(patch_values, c, c));
  if (shape.text_branch == "clip")
    word_feature_ = register_module("word_feature", torch::nn::Linear(clip_text_width, c));
  pose_ = register_module("pose", Mlp(9, c, c));
  instruction_ = register_module("instruction", Mlp(c, c, c));
  image_tokens_ = register_module("image_tokens", PointTokens(point_features, c, shape.binding));
  region_tokens_ = register_module("region_tokens", PointTokens(region_features, c, shape.binding));
  const auto stack = [&](const char* name, int blocks, int condition_dim) {
    return register_module(name, make_backbone(backbone, {.channels = c,
                                                          .d_state = shape.d_state,
                                                          .blocks = blocks,
                                                          .condition_dim = condition_dim}));
  };
  prefix_ = stack("prefix", shape.prefix_blocks, 0);
  const bool grouped = shape.point_encoder && shape.point_groups > 0;
  point_encoder_ = stack("point_encoder", shape.point_encoder && !grouped ? shape.point_blocks : 0, 0);
  if (grouped) groups_ = register_module("point_groups", PointEncoder(shape, backbone));
  fusion_ = stack("fusion", shape.fusion_blocks, 0);
  velocity_ = stack("velocity", shape.velocity_blocks, c);
  out_norm_ = register_module("out_norm", torch::nn::LayerNorm(torch::nn::LayerNormOptions({c})));
  if (shape.grounded)
    grounding_ = register_module("grounding", Grounding(c, shape.heads));
  else
    plain_velocity_ = register_module("plain_velocity", Mlp(c, c, 9));
  open_ = register_module("open", Mlp(c, c, 1));
}

void FlowRamNetworkImpl::compute_by(ScanPath path, bool recompute_prefix) {
  for (const Backbone& stack : {prefix_, point_encoder_, fusion_, velocity_}) stack->run_by(path);
  if (groups_) groups_->run_by(path);
  for (const auto& module : modules())
    if (auto* mlp = dynamic_cast<MlpImpl*>(module.get())) mlp->run_by(path);
  image_tokens_->run_by(path);
  region_tokens_->run_by(path);
  recompute_prefix_ = recompute_prefix;
}

torch::Tensor FlowRamNetworkImpl::time_embedding(const torch::Tensor& t) {
  const torch::Tensor frequency =
      torch::exp(torch::arange(time_features, t.options()) * (std::log(200.0) / (time_features - 1)));
  const torch::Tensor phase = t.unsqueeze(1) * frequency.unsqueeze(0);
  return time_->forward(torch::cat({phase.sin(), phase.cos()}, -1));
}

torch::Tensor FlowRamNetworkImpl::look(const SceneBatch& s) {
  return clip_image_ ? clip_image_->forward(s.pictures, s.patch_place) : patch_->forward(s.patches);
}

SceneMemory FlowRamNetworkImpl::encode(const SceneBatch& s) {
  const torch::Tensor is_word = (s.word_row != Vocabulary::pad).to(torch::kFloat32);
  const torch::Tensor is_color = (s.word_row == Vocabulary::color).to(torch::kFloat32);
  const torch::Tensor mention = mention_table_(s.word_mention);
  SceneMemory m;
  // Roles carry no colour: which word matters now must not depend on what it happens to say.
  torch::Tensor roles = word_table_(s.word_row) + mention;
  if (word_feature_) roles = roles + word_feature_(s.word_feature);
  roles = roles * is_word.unsqueeze(-1);
  m.words = roles + (place_table_->weight.unsqueeze(0) + word_color_(s.word_color) * is_color.unsqueeze(-1)) *
                        is_word.unsqueeze(-1);
  const torch::Tensor keyframe = keyframe_table_(s.keyframe_index);
  const torch::Tensor pooled = roles.sum(1) / is_word.sum(1, true).clamp_min(1);
  const torch::Tensor intent = keyframe + instruction_->forward(pooled);
  m.condition = proprioception_->forward(s.history.flatten(1)) + intent;
  const BoundTokens image =
      image_tokens_(s.image_feature, s.image_color,
                    image_tokens_->read_words(m.words, s.word_color, is_color, is_word, mention), look(s));
  m.region_words = region_tokens_->read_words(m.words, s.word_color, is_color, is_word, mention);
  m.image_raw = image.token;
  m.history_raw = history_->forward(s.history) + keyframe.unsqueeze(1);
  m.image_position = s.image_position;
  m.history_position = s.history_position;
  m.tool_axes = s.tool_axes;
  if (grounding_) {
    m.sought = grounding_->seek(intent, roles, is_word);
    m.image_points.places = GroundingImpl::places(
        s.image_position, s.image_feature.narrow(2, world_normal_at, 3), s.image_moments);
    m.image_points.penalty = GroundingImpl::penalty(m.sought, image.mismatch);
    m.history_points.places = torch::constant_pad_nd(s.history_position, {0, 7});
  }
  run_prefix(m);
  return m;
}

void FlowRamNetworkImpl::run_prefix(SceneMemory& m) {
  m.image = m.image_raw;
  m.history = m.history_raw;
  if (shape_.paper_order) return;
  const std::int64_t words = m.words.size(1), tokens = m.image_raw.size(1);
  torch::Tensor all = prefix_->forward(torch::cat({m.words, m.image_raw, m.history_raw}, 1));
  if (shape_.stored_state) {
    m.fusion_state.clear();
    m.velocity_state.clear();
    all = fusion_->forward_from(m.fusion_state, all);
    // No time in the condition of what must not change with it.
    all = velocity_->forward_from(m.velocity_state, all, m.condition);
  }
  m.image = all.narrow(1, words, tokens);
  m.history = all.narrow(1, words + tokens, history_length);
  m.image_points.token = m.image + m.image_raw;
  if (shape_.stored_state) m.history_points.token = m.history;
}

FlowRamNetworkImpl::Fused FlowRamNetworkImpl::fuse(const SceneMemory& m, const torch::Tensor& region,
                                                   const torch::Tensor& pose, const torch::Tensor& condition,
                                                   std::int64_t draws) {
  const std::int64_t n = region.size(1);
  if (shape_.paper_order) {
    const std::int64_t tokens = m.image.size(1), words = m.words.size(1);
    torch::Tensor all = torch::cat(
        {region, per_draw(m.image, draws), per_draw(m.words, draws), per_draw(m.history, draws), pose}, 1);
    all = velocity_->forward(fusion_->forward(prefix_->forward(all)), condition);
    const std::int64_t past = n + tokens + words;
    return {all.narrow(1, 0, n), all.narrow(1, n, tokens), all.narrow(1, past, history_length),
            all.select(1, past + history_length)};
  }
  if (shape_.stored_state) {
    BackboneState fusion = repeat_rows(m.fusion_state, draws),
                  velocity = repeat_rows(m.velocity_state, draws);
    const torch::Tensor fused = fusion_->forward_from(fusion, torch::cat({region, pose}, 1));
    const torch::Tensor all = velocity_->forward_from(velocity, fused, condition);
    return {all.narrow(1, 0, n), {}, {}, all.select(1, n)};
  }
  const torch::Tensor all = velocity_->forward(
      fusion_->forward(torch::cat({per_draw(m.history, draws), region, pose}, 1)), condition);
  return {all.narrow(1, history_length, n),
          {},
          all.narrow(1, 0, history_length),
          all.select(1, history_length + n)};
}

// All draws of a scene in one row: its words are read once for them.
BoundTokens FlowRamNetworkImpl::bind_region(const SceneMemory& m, const DrawBatch& d) {
  const std::int64_t scenes = m.words.size(0), batch = d.x.size(0), points = d.region_color.size(1);
  const auto by_scene = [&](const torch::Tensor& t) {
    return t.reshape({scenes, batch / scenes * points, t.size(2)});
  };
  const BoundTokens all =
      region_tokens_(by_scene(d.region_feature), by_scene(d.region_color), m.region_words);
  return {all.token.view({batch, points, -1}), all.mismatch.view({batch, points, -1})};
}

FlowRamNetworkImpl::Geometry FlowRamNetworkImpl::encode_points(const BoundTokens& bound, const DrawBatch& d) {
  const torch::Tensor places = GroundingImpl::places(
      d.region_position, d.region_feature.narrow(2, world_normal_at, 3), d.region_moments);
  if (!groups_)
    return {point_encoder_->forward(bound.token), bound.token, d.region_position, places, bound.mismatch};
  const GroupTokens g = groups_->forward(bound.token, d.region_place);
  const torch::Tensor center =
      (g.center + bound.token.size(1) * torch::arange(g.center.size(0), g.center.options()).unsqueeze(1))
          .flatten();
  const auto at_centers = [&](const torch::Tensor& per_point) {
    return per_point.flatten(0, 1).index_select(0, center).view({g.center.size(0), g.center.size(1), -1});
  };
  return {g.token, at_centers(bound.token), at_centers(d.region_position), at_centers(places),
          at_centers(bound.mismatch)};
}

std::vector<GroundingImpl::Points> FlowRamNetworkImpl::points_of(const SceneMemory& m, const Fused& fused,
                                                                 const Geometry& geometry,
                                                                 std::int64_t draws) {
  const auto each_draw = [draws](const GroundingImpl::Points& p, const torch::Tensor& token) {
    return GroundingImpl::Points{token, per_draw(p.places, draws),
                                 p.penalty.defined() ? per_draw(p.penalty, draws) : p.penalty};
  };
  return {{fused.region + geometry.raw, geometry.places,
           GroundingImpl::penalty(per_draw(m.sought, draws), geometry.mismatch)},
          fused.image.defined() ? each_draw(m.image_points, fused.image + per_draw(m.image_raw, draws))
                                : m.image_points,
          fused.history.defined() ? each_draw(m.history_points, fused.history) : m.history_points};
}

NetworkOutput FlowRamNetworkImpl::forward(const SceneMemory& memory, const DrawBatch& d,
                                          const PositionScale& scale) {
  SceneMemory m = memory;
  if (recompute_prefix_) run_prefix(m);
  const std::int64_t draws = d.x.size(0) / m.words.size(0);
  const torch::Tensor condition = per_draw(m.condition, draws) + time_embedding(d.t);
  const BoundTokens bound = bind_region(m, d);
  const torch::Tensor pose = (pose_->forward(d.x) + condition).unsqueeze(1);
  const Geometry geometry = encode_points(bound, d);
  const Fused fused = fuse(m, geometry.token, pose, condition, draws);
  const torch::Tensor action = out_norm_(fused.action) + condition;

  NetworkOutput out;
  out.open_logit = open_->forward(action).squeeze(-1);
  if (!shape_.grounded) {
    out.action = plain_velocity_->forward(action);
    return out;
  }
  const auto result =
      grounding_->forward(action, points_of(m, fused, geometry, draws), per_draw(m.tool_axes, draws), scale);
  out.action = result.end_point;
  out.weights = result.weights;
  out.weight_position = torch::cat(
      {geometry.position, per_draw(m.image_position, draws), per_draw(m.history_position, draws)}, 1);
  return out;
}

}  // namespace flowscope
