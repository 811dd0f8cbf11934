#include "policy/grounding.h"

#include <numbers>
#include <vector>

#include "policy/symmetric_yaw.h"

namespace flowscope {
namespace {

// Directions per head beside the tool's three: difference to the mean anchor, the same up to quarter turns,
// normal, yaw of a square by its sides and by its corners, yaw of a bar; each with its horizontal
// perpendicular.
constexpr int per_head = 12;
constexpr double offset_unit_m = 0.1;

// e_z × v.
torch::Tensor quarter_turn(const torch::Tensor& v) {
  return torch::stack({-v.select(-1, 1), v.select(-1, 0), torch::zeros_like(v.select(-1, 0))}, -1);
}

/// Row by row of the points: a scene's draws stand together in its row.
torch::Tensor score(const torch::Tensor& sought_token, const GroundingImpl::Points& part) {
  const std::int64_t batch = sought_token.size(0), heads = sought_token.size(1), rows = part.token.size(0);
  const std::int64_t points = part.token.size(1);
  torch::Tensor scores =
      torch::bmm(sought_token.reshape({rows, batch / rows * heads, -1}), part.token.transpose(1, 2));
  if (part.penalty.defined())
    scores = scores.view({rows, batch / rows, heads, points}) - part.penalty.unsqueeze(1);
  return scores.view({batch, heads, points});
}

/// What each head points at: [B, H, 10] of weights [B, H, P].
torch::Tensor read_places(const torch::Tensor& weights, const std::vector<GroundingImpl::Points>& parts) {
  const std::int64_t batch = weights.size(0), heads = weights.size(1);
  torch::Tensor sum;
  std::int64_t first = 0;
  for (const GroundingImpl::Points& part : parts) {
    const std::int64_t rows = part.places.size(0), points = part.places.size(1);
    const torch::Tensor mine = weights.narrow(2, first, points).reshape({rows, batch / rows * heads, points});
    const torch::Tensor read = torch::bmm(mine, part.places).view({batch, heads, -1});
    sum = sum.defined() ? sum + read : read;
    first += points;
  }
  return sum;
}

torch::Tensor as_tensor(const Eigen::Vector3d& v, const torch::Tensor& like) {
  return torch::tensor({static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())})
      .to(like.device());
}

}  // namespace

GroundingImpl::GroundingImpl(int channels, int heads)
    : heads_(heads),
      key_(register_module("key", torch::nn::Linear(channels, key_size_ * heads))),
      word_key_(register_module("word_key", torch::nn::Linear(channels, key_size_ * heads))),
      word_query_(register_module("word_query", torch::nn::Linear(channels, key_size_ * heads))),
      mix_(register_module("mix", torch::nn::Linear(channels, heads))),
      read_(register_module("read", torch::nn::Linear(channels, 3 * (3 + per_head * heads) + 9))),
      query_(register_module("query", Mlp(channels, channels, key_size_ * heads))) {
  const torch::NoGradGuard no_grad;
  read_->weight.mul_(0.1);
  read_->bias.zero_();
}

torch::Tensor GroundingImpl::places(const torch::Tensor& position, const torch::Tensor& normal,
                                    const torch::Tensor& moments) {
  return torch::cat({position, normal, moments}, 2);
}

torch::Tensor GroundingImpl::seek(const torch::Tensor& intent, const torch::Tensor& roles,
                                  const torch::Tensor& is_word) {
  const std::int64_t scenes = intent.size(0);
  const torch::Tensor keys =
      word_key_(roles).view({scenes, roles.size(1), heads_, key_size_}).permute({0, 2, 1, 3});
  const torch::Tensor query = word_query_(intent).view({scenes, heads_, key_size_, 1});
  const torch::Tensor scores =
      torch::matmul(keys, query).squeeze(-1).masked_fill((is_word < 0.5).unsqueeze(1), -1e9);
  return torch::softmax(scores, -1);
}

torch::Tensor GroundingImpl::penalty(const torch::Tensor& sought, const torch::Tensor& mismatch) {
  return torch::bmm(sought, mismatch.transpose(1, 2));
}

GroundingImpl::Result GroundingImpl::forward(const torch::Tensor& action, const std::vector<Points>& parts,
                                             const torch::Tensor& tool_axes, const PositionScale& scale) {
  const std::int64_t batch = action.size(0);
  // query · (K token + b) as (Kᵀ query) · token: no key of a point is built, and what b adds to all points of
  // a head is nothing to the softmax.
  const torch::Tensor query = query_->forward(action).view({batch, heads_, 1, key_size_});
  const torch::Tensor sought_token =
      torch::matmul(query, key_->weight.view({heads_, key_size_, -1})).squeeze(2);  // [B, H, C]
  std::vector<torch::Tensor> scores;
  for (const Points& part : parts) scores.push_back(score(sought_token, part));
  const torch::Tensor weights = torch::softmax(torch::cat(scores, 2), -1);  // [B, H, P]
  const torch::Tensor pointed = read_places(weights, parts);                // [B, H, 10]
  const torch::Tensor anchors = pointed.narrow(2, 0, 3), normals = pointed.narrow(2, 3, 3),
                      moments = pointed.narrow(2, 6, 4);
  const torch::Tensor mix = torch::softmax(mix_(action), -1).unsqueeze(1);  // [B, 1, H]
  const torch::Tensor base = torch::bmm(mix, anchors).squeeze(1);

  const torch::Tensor differences = anchors - base.unsqueeze(1);
  const torch::Tensor directions = differences / (differences.norm(2, -1, true) + 0.02);
  std::vector<torch::Tensor> basis_parts{tool_axes};
  const torch::Tensor tool_x = tool_axes.select(1, 0);
  const auto yaw = [&](int n, double offset) {
    return symmetric_yaw(moments.narrow(2, n == 4 ? 0 : 2, 2), tool_x, n, offset);
  };
  for (const torch::Tensor& d : {directions, nearest_quarter(directions, tool_x), normals, yaw(4, 0),
                                 yaw(4, std::numbers::pi / 4), yaw(2, 0)}) {
    basis_parts.push_back(d);
    basis_parts.push_back(quarter_turn(d));
  }
  const torch::Tensor basis = torch::cat(basis_parts, 1);
  const torch::Tensor read = read_(action);
  const std::int64_t size = 3 + per_head * heads_;
  const torch::Tensor combined = torch::bmm(read.narrow(1, 0, 3 * size).view({batch, 3, size}), basis);
  const torch::Tensor constants = read.narrow(1, 3 * size, 9).view({batch, 3, 3});
  const torch::Tensor vectors = combined + constants;  // [B, 3, 3]: offset, rotation column 1, column 2

  const torch::Tensor position = base + offset_unit_m * vectors.select(1, 0);
  const torch::Tensor normalised =
      (position - as_tensor(scale.center, position)) / as_tensor(scale.half, position);
  return {torch::cat({normalised, vectors.select(1, 1), vectors.select(1, 2)}, -1),
          torch::bmm(mix, weights).squeeze(1)};
}

}  // namespace flowscope
