#include "policy/network.h"

#include <cmath>

namespace flowscope {
namespace {

torch::nn::Sequential mlp(int in, int channels) {
  return torch::nn::Sequential(torch::nn::Linear(in, channels), torch::nn::GELU(),
                               torch::nn::Linear(channels, channels));
}

// One row per scene to one row per draw.
torch::Tensor per_draw(const torch::Tensor& x, std::int64_t draws) {
  return draws == 1 ? x : x.repeat_interleave(draws, 0);
}

constexpr int time_features = 32;
constexpr std::int64_t world_normal_at = 9;  // place of the normal in the point features

}  // namespace

FlowRamNetworkImpl::FlowRamNetworkImpl(const NetworkShape& shape, const std::string& backbone)
    : shape_(shape) {
  const int c = shape.channels;
  word_table_ = register_module("word_table", torch::nn::Embedding(shape.vocabulary, c));
  mention_table_ = register_module("mention_table", torch::nn::Embedding(8, c));
  place_table_ = register_module("place_table", torch::nn::Embedding(shape.words, c));
  keyframe_table_ = register_module("keyframe_table", torch::nn::Embedding(keyframe_rows, c));
  word_color_ = register_module("word_color", torch::nn::Linear(3, c));
  history_ = register_module("history", mlp(history_features, c));
  proprioception_ = register_module("proprioception", mlp(history_features * history_length, c));
  time_ = register_module("time", mlp(2 * time_features, c));
  patch_ = register_module("patch", mlp(patch_values, c));
  pose_ = register_module("pose", mlp(9, c));
  instruction_ = register_module("instruction", mlp(c, c));
  image_tokens_ = register_module("image_tokens", PointTokens(point_features, c));
  region_tokens_ = register_module("region_tokens", PointTokens(region_features, c));
  const auto stack = [&](const char* name, int blocks, int condition_dim) {
    return register_module(name, make_backbone(backbone, {.channels = c,
                                                          .d_state = shape.d_state,
                                                          .blocks = blocks,
                                                          .condition_dim = condition_dim}));
  };
  prefix_ = stack("prefix", shape.prefix_blocks, 0);
  point_encoder_ = stack("point_encoder", shape.point_encoder ? shape.point_blocks : 0, 0);
  fusion_ = stack("fusion", shape.fusion_blocks, 0);
  velocity_ = stack("velocity", shape.velocity_blocks, c);
  out_norm_ = register_module("out_norm", torch::nn::LayerNorm(torch::nn::LayerNormOptions({c})));
  if (shape.grounded)
    grounding_ = register_module("grounding", Grounding(c, shape.heads));
  else
    plain_velocity_ = register_module(
        "plain_velocity",
        torch::nn::Sequential(torch::nn::Linear(c, c), torch::nn::GELU(), torch::nn::Linear(c, 9)));
  open_ = register_module(
      "open", torch::nn::Sequential(torch::nn::Linear(c, c), torch::nn::GELU(), torch::nn::Linear(c, 1)));
}

torch::Tensor FlowRamNetworkImpl::time_embedding(const torch::Tensor& t) {
  const torch::Tensor frequency =
      torch::exp(torch::arange(time_features, torch::kFloat32) * (std::log(200.0) / (time_features - 1)));
  const torch::Tensor phase = t.unsqueeze(1) * frequency.unsqueeze(0);
  return time_->forward(torch::cat({phase.sin(), phase.cos()}, -1));
}

SceneMemory FlowRamNetworkImpl::encode(const SceneBatch& s) {
  const torch::Tensor is_word = (s.word_row != Vocabulary::pad).to(torch::kFloat32);
  const torch::Tensor is_color = (s.word_row == Vocabulary::color).to(torch::kFloat32);
  const torch::Tensor mention = mention_table_(s.word_mention);
  SceneMemory m;
  m.word_row = s.word_row;
  m.word_mention = s.word_mention;
  m.word_color = s.word_color;
  // Roles carry no colour: which word matters now must not depend on what it happens to say.
  m.roles = (word_table_(s.word_row) + mention) * is_word.unsqueeze(-1);
  m.words =
      m.roles + (place_table_->weight.unsqueeze(0) + word_color_(s.word_color) * is_color.unsqueeze(-1)) *
                    is_word.unsqueeze(-1);
  const torch::Tensor keyframe = keyframe_table_(s.keyframe_index);
  const torch::Tensor pooled = m.roles.sum(1) / is_word.sum(1, true).clamp_min(1);
  m.intent = keyframe + instruction_->forward(pooled);
  m.condition = proprioception_->forward(s.history.flatten(1)) + m.intent;
  const BoundTokens image = image_tokens_(s.image_feature, s.image_color, m.words, s.word_color, is_color,
                                          is_word, mention, patch_->forward(s.patches));
  m.image_raw = image.token;
  m.image_mismatch = image.mismatch;
  const torch::Tensor history = history_->forward(s.history) + keyframe.unsqueeze(1);
  if (shape_.paper_order) {
    m.image = m.image_raw;
    m.history = history;
  } else {
    const std::int64_t words = m.words.size(1), tokens = m.image_raw.size(1);
    const torch::Tensor fused = prefix_->forward(torch::cat({m.words, m.image_raw, history}, 1));
    m.image = fused.narrow(1, words, tokens);
    m.history = fused.narrow(1, words + tokens, history_length);
  }
  m.image_position = s.image_position;
  m.image_moments = s.image_moments;
  m.history_position = s.history_position;
  m.tool_axes = s.tool_axes;
  m.image_normal = s.image_feature.narrow(2, world_normal_at, 3);
  return m;
}

NetworkOutput FlowRamNetworkImpl::forward(const SceneMemory& m, const DrawBatch& d,
                                          const PositionScale& scale) {
  const std::int64_t draws = d.x.size(0) / m.words.size(0), n = d.region_feature.size(1);
  const torch::Tensor row = per_draw(m.word_row, draws), words = per_draw(m.words, draws);
  const torch::Tensor is_word = (row != Vocabulary::pad).to(torch::kFloat32);
  const torch::Tensor is_color = (row == Vocabulary::color).to(torch::kFloat32);
  const torch::Tensor mention = mention_table_(per_draw(m.word_mention, draws));
  const torch::Tensor condition = per_draw(m.condition, draws) + time_embedding(d.t);

  const BoundTokens bound = region_tokens_(d.region_feature, d.region_color, words,
                                           per_draw(m.word_color, draws), is_color, is_word, mention);
  torch::Tensor region = bound.token;
  region = point_encoder_->forward(region);
  torch::Tensor image = per_draw(m.image, draws), history = per_draw(m.history, draws);
  const torch::Tensor pose = (pose_->forward(d.x) + condition).unsqueeze(1);

  if (shape_.paper_order) {
    const std::int64_t tokens = image.size(1), w = words.size(1);
    torch::Tensor all = torch::cat({region, image, words, history, pose}, 1);
    all = velocity_->forward(fusion_->forward(prefix_->forward(all)), condition);
    region = all.narrow(1, 0, n);
    image = all.narrow(1, n, tokens);
    history = all.narrow(1, n + tokens + w, history_length + 1);
  } else {
    torch::Tensor all =
        velocity_->forward(fusion_->forward(torch::cat({history, region, pose}, 1)), condition);
    region = all.narrow(1, history_length, n);
    history = torch::cat({all.narrow(1, 0, history_length), all.narrow(1, history_length + n, 1)}, 1);
  }
  const torch::Tensor action = out_norm_(history.select(1, history_length)) + condition;
  history = history.narrow(1, 0, history_length);

  NetworkOutput out;
  out.open_logit = open_->forward(action).squeeze(-1);
  if (!shape_.grounded) {
    out.action = plain_velocity_->forward(action);
    return out;
  }
  const torch::Tensor past = per_draw(m.history_position, draws);
  const GroundingImpl::Points points{
      torch::cat({region + bound.token, image + per_draw(m.image_raw, draws), history}, 1),
      torch::cat({d.region_position, per_draw(m.image_position, draws), past}, 1),
      torch::cat({d.region_feature.narrow(2, world_normal_at, 3), per_draw(m.image_normal, draws),
                  torch::zeros_like(past)},
                 1),
      torch::cat(
          {d.region_moments, per_draw(m.image_moments, draws), torch::zeros({past.size(0), past.size(1), 4})},
          1),
      torch::cat({bound.mismatch, per_draw(m.image_mismatch, draws),
                  torch::zeros({past.size(0), past.size(1), words.size(1)})},
                 1)};
  const auto result = grounding_->forward(action, per_draw(m.intent, draws), points, per_draw(m.roles, draws),
                                          is_word, per_draw(m.tool_axes, draws), scale);
  out.action = result.end_point;
  out.weights = result.weights;
  return out;
}

}  // namespace flowscope
