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
      query_(register_module("query",
                             torch::nn::Sequential(torch::nn::Linear(channels, channels), torch::nn::GELU(),
                                                   torch::nn::Linear(channels, key_size_ * heads)))) {
  const torch::NoGradGuard no_grad;
  read_->weight.mul_(0.1);
  read_->bias.zero_();
}

GroundingImpl::Result GroundingImpl::forward(const torch::Tensor& action, const torch::Tensor& intent,
                                             const Points& points, const torch::Tensor& roles,
                                             const torch::Tensor& is_word, const torch::Tensor& tool_axes,
                                             const PositionScale& scale) {
  const std::int64_t batch = action.size(0);
  // query · (K token + b) as (Kᵀ query) · token: no key of a point is built, and what b adds to all points of
  // a head is nothing to the softmax.
  const torch::Tensor query = query_->forward(action).view({batch, heads_, 1, key_size_});
  const torch::Tensor sought_token =
      torch::matmul(query, key_->weight.view({heads_, key_size_, -1})).squeeze(2);  // [B, H, C]
  const torch::Tensor word_keys =
      word_key_(roles).view({batch, roles.size(1), heads_, key_size_}).permute({0, 2, 1, 3});
  const torch::Tensor word_query = word_query_(intent).view({batch, heads_, key_size_, 1});
  const torch::Tensor word_scores =
      torch::matmul(word_keys, word_query).squeeze(-1).masked_fill((is_word < 0.5).unsqueeze(1), -1e9);
  const torch::Tensor sought = torch::softmax(word_scores, -1);  // [B, H, W]
  const torch::Tensor scores = torch::bmm(sought_token, points.token.transpose(1, 2)) -
                               torch::bmm(sought, points.mismatch.transpose(1, 2));
  const torch::Tensor weights = torch::softmax(scores, -1);            // [B, H, P]
  const torch::Tensor anchors = torch::bmm(weights, points.position);  // [B, H, 3] metres
  const torch::Tensor normals = torch::bmm(weights, points.normal);
  const torch::Tensor mix = torch::softmax(mix_(action), -1).unsqueeze(1);  // [B, 1, H]
  const torch::Tensor base = torch::bmm(mix, anchors).squeeze(1);

  const torch::Tensor differences = anchors - base.unsqueeze(1);
  const torch::Tensor directions = differences / (differences.norm(2, -1, true) + 0.02);
  std::vector<torch::Tensor> basis_parts{tool_axes};
  const torch::Tensor tool_x = tool_axes.select(1, 0);
  const torch::Tensor moments = torch::bmm(weights, points.moments);  // [B, H, 4]
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
