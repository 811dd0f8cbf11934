#include "policy/point_encoder.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "policy/fused_groups.h"
#include "policy/packed_layer.h"
#include "policy/point_groups.h"
#include "policy/pointwise.h"

namespace flowscope {
namespace {

/// Indices of a batch, int64 and flat: point i of item b is b * n + i, group g is b * G + g.
struct BatchGroups {
  torch::Tensor center;     ///< [B * G]
  torch::Tensor neighbour;  ///< [B * G * k]
  torch::Tensor reading;    ///< [B * 2 G] groups in the order of both curves
  torch::Tensor reach;      ///< [B, 1, 1] metres
};

// Inside a parallel loop over a batch this is that loop's thread alone.
void over_threads(int count, const std::function<void(int first, int last)>& part) {
  at::parallel_for(0, count, 64, [&part](std::int64_t first, std::int64_t last) {
    part(static_cast<int>(first), static_cast<int>(last));
  });
}

BatchGroups group_batch(const torch::Tensor& position, std::int64_t groups, std::int64_t size) {
  const torch::Tensor plain = position.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  const std::int64_t batch = plain.size(0), n = plain.size(1);
  BatchGroups out{torch::empty({batch * groups}, torch::kInt64),
                  torch::empty({batch * groups * size}, torch::kInt64),
                  torch::empty({batch * 2 * groups}, torch::kInt64), torch::empty({batch, 1, 1})};
  const float* const from = plain.data_ptr<float>();
  auto *center = out.center.data_ptr<std::int64_t>(), *neighbour = out.neighbour.data_ptr<std::int64_t>(),
       *reading = out.reading.data_ptr<std::int64_t>();
  auto* const reach = out.reach.data_ptr<float>();
  at::parallel_for(0, batch, 1, [&](std::int64_t first, std::int64_t last) {
    for (std::int64_t b = first; b < last; ++b) {
      std::vector<Eigen::Vector3f> points;
      for (std::int64_t i = b * n; i < (b + 1) * n; ++i)
        points.emplace_back(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
      const PointGroups g =
          group_points(points, static_cast<int>(groups), static_cast<int>(size), over_threads);
      const auto write = [](const std::vector<int>& numbers, std::int64_t base, std::int64_t* to) {
        for (const int i : numbers) *to++ = base + i;
      };
      write(g.center, b * n, center + b * groups);
      write(g.neighbour, b * n, neighbour + b * groups * size);
      write(g.hilbert, b * groups, reading + 2 * b * groups);
      write(g.transposed_hilbert, b * groups, reading + (2 * b + 1) * groups);
      reach[b] = std::max(g.reach_m, 1e-6f);
    }
  });
  for (torch::Tensor* t : {&out.center, &out.neighbour, &out.reading, &out.reach})
    *t = t->to(position.device());
  return out;
}

// Over the members of each group.
torch::Tensor greatest(const torch::Tensor& x) { return x.amax(2); }

}  // namespace

PointEncoderImpl::PointEncoderImpl(const NetworkShape& shape, const std::string& backbone)
    : channels_(shape.channels), groups_(shape.point_groups), size_(shape.group_size) {
  if (groups_ < 1 || size_ < 1)
    throw std::invalid_argument("point encoder: point_groups and group_size must be at least 1");
  const int c = channels_;
  const auto without_bias = [c](int in) {
    return torch::nn::Linear(torch::nn::LinearOptions(in, c).bias(false));
  };
  token_in_ = register_module("token_in", torch::nn::Linear(c, c));
  place_in_ = register_module("place_in", without_bias(3));
  inner_ = register_module("inner", torch::nn::Linear(c, c));
  pooled_ = register_module("pooled", without_bias(c));
  out_ = register_module("out", torch::nn::Linear(c, c));
  place_ = register_module("place", Mlp(3, c, c));
  scale_ = register_parameter("scale", 1 + 0.02 * torch::randn({2, c}));
  shift_ = register_parameter("shift", 0.02 * torch::randn({2, c}));
  blocks_ = register_module(
      "blocks",
      make_backbone(backbone, {.channels = c, .d_state = shape.d_state, .blocks = shape.point_blocks}));
}

void PointEncoderImpl::require_fitting(const torch::Tensor& tokens, const torch::Tensor& position) const {
  if (tokens.dim() == 3 && position.dim() == 3 && tokens.size(2) == channels_ && position.size(2) == 3 &&
      tokens.size(0) == position.size(0) && tokens.size(1) == position.size(1) &&
      tokens.size(1) >= std::max(groups_, size_))
    return;
  std::ostringstream what;
  what << "point encoder: tokens " << tokens.sizes() << " and positions " << position.sizes()
       << " where [B, n, " << channels_ << "] and [B, n, 3] are wanted, n at least "
       << std::max(groups_, size_);
  throw std::invalid_argument(what.str());
}

torch::Tensor PointEncoderImpl::embed_groups(const torch::Tensor& tokens, const torch::Tensor& relative,
                                             const torch::Tensor& neighbour) {
  if (path_ == ScanPath::fused && plain_arrays(tokens, inner_->weight)) {
    return fused_groups({token_in_->weight, token_in_->bias, place_in_->weight, inner_->weight, inner_->bias,
                         pooled_->weight, out_->weight, out_->bias},
                        tokens, relative, neighbour);
  }
  const std::int64_t batch = tokens.size(0);
  torch::Tensor h = token_in_(tokens).flatten(0, 1).index_select(0, neighbour);
  h = h.view({batch, groups_, size_, channels_}).add_(place_in_(relative));
  h = gelu_of(h);
  const torch::Tensor u = gelu_of(inner_(h).add_(pooled_(greatest(h)).unsqueeze(2)));
  return out_(greatest(u));
}

GroupTokens PointEncoderImpl::forward(const torch::Tensor& tokens, const torch::Tensor& position) {
  require_fitting(tokens, position);
  const std::int64_t batch = tokens.size(0), n = tokens.size(1);
  const BatchGroups groups = group_batch(position, groups_, size_);
  const torch::Tensor flat = position.reshape({batch * n, 3});
  const torch::Tensor center = flat.index_select(0, groups.center).view({batch, groups_, 3});
  const torch::Tensor member = flat.index_select(0, groups.neighbour).view({batch, groups_, size_, 3});
  const torch::Tensor relative = (member - center.unsqueeze(2)) / groups.reach.unsqueeze(3);
  const torch::Tensor from_middle = position - position.mean(1, true);
  const torch::Tensor spread = from_middle.square().sum(2, true).mean(1, true).sqrt().clamp_min(1e-6);
  const torch::Tensor place = (center - position.mean(1, true)) / spread;

  const torch::Tensor group = embed_groups(tokens, relative, groups.neighbour) + place_->forward(place);
  const torch::Tensor read =
      group.flatten(0, 1).index_select(0, groups.reading).view({batch, 2, groups_, channels_});
  const torch::Tensor sequence = (read * scale_.unsqueeze(1) + shift_.unsqueeze(1)).flatten(1, 2);
  const torch::Tensor first_point = n * torch::arange(batch, groups.center.options()).unsqueeze(1);
  return {blocks_->forward(sequence),
          groups.center.index_select(0, groups.reading).view({batch, 2 * groups_}) - first_point};
}

}  // namespace flowscope
