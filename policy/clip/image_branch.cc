#include "policy/clip/image_branch.h"

#include <sstream>
#include <stdexcept>

namespace flowscope {
namespace {

constexpr std::int64_t finest_stride = 2;  // of taps[0]

[[noreturn]] void fail(const std::string& what, const torch::Tensor& found) {
  std::ostringstream text;
  text << "clip image branch: " << what << ", not " << found.toString() << " " << found.sizes();
  throw std::invalid_argument(text.str());
}

}  // namespace

torch::Tensor gather_features(const torch::Tensor& maps, const torch::Tensor& place, std::int64_t height,
                              std::int64_t width) {
  if (place.dim() != 3 || place.size(2) != 3 || place.scalar_type() != torch::kFloat32 || place.numel() == 0)
    fail("places must be float32 [S, M, 3]", place);
  const std::int64_t scenes = place.size(0), tokens = place.size(1);
  if (maps.dim() != 4 || maps.size(0) == 0 || maps.size(0) % scenes != 0)
    fail("there must be as many pictures in each of " + std::to_string(scenes) + " scenes", maps);
  const std::int64_t views = maps.size(0) / scenes, channels = maps.size(1), h = maps.size(2),
                     w = maps.size(3);
  const torch::Tensor view = place.select(2, 0).to(torch::kInt64);
  if (view.min().item<std::int64_t>() < 0 || view.max().item<std::int64_t>() >= views)
    throw std::invalid_argument("clip image branch: a place is in no view 0 … " + std::to_string(views - 1));
  // In cells, counted from the centre of the first one.
  const auto cell = [&](int axis, std::int64_t pixels, std::int64_t cells) {
    const double per_pixel = static_cast<double>(cells) / static_cast<double>(pixels);
    return (place.select(2, axis) * per_pixel - 0.5).clamp(0, static_cast<double>(cells - 1));
  };
  const torch::Tensor x = cell(1, width, w), y = cell(2, height, h);
  const torch::Tensor x0 = x.floor(), y0 = y.floor(), fx = x - x0, fy = y - y0;
  const torch::Tensor left = x0.to(torch::kInt64), top = y0.to(torch::kInt64);
  const torch::Tensor right = (left + 1).clamp_max(w - 1), bottom = (top + 1).clamp_max(h - 1);
  const torch::Tensor scene = torch::arange(scenes, view.options()).unsqueeze(1);
  const torch::Tensor picture = (scene * views + view) * h;
  const torch::Tensor rows = maps.permute({0, 2, 3, 1}).reshape({-1, channels});
  const auto corner = [&](const torch::Tensor& row, const torch::Tensor& column,
                          const torch::Tensor& weight) {
    const torch::Tensor at = ((picture + row) * w + column).flatten();
    return rows.index_select(0, at) * weight.reshape({-1, 1});
  };
  const torch::Tensor sum = corner(top, left, (1 - fy) * (1 - fx)) + corner(top, right, (1 - fy) * fx) +
                            corner(bottom, left, fy * (1 - fx)) + corner(bottom, right, fy * fx);
  return sum.view({scenes, tokens, channels});
}

ClipImageBranchImpl::ClipImageBranchImpl(std::shared_ptr<const ClipResNet> trunk, std::int64_t channels)
    : trunk_(std::move(trunk)) {
  if (!trunk_) throw std::invalid_argument("clip image branch: there is no trunk");
  pyramid_ = register_module("pyramid", ClipPyramid(trunk_->tap_channels(), channels));
}

torch::Tensor ClipImageBranchImpl::forward(const torch::Tensor& pictures, const torch::Tensor& place) {
  return from_taps(trunk_->forward(pictures), place);
}

torch::Tensor ClipImageBranchImpl::from_taps(const ClipTaps& taps, const torch::Tensor& place) {
  const std::int64_t height = taps[1].size(2) * 2 * finest_stride,
                     width = taps[1].size(3) * 2 * finest_stride;
  return gather_features(pyramid_->forward(taps, pyramid_level(height, width)), place, height, width);
}

}  // namespace flowscope
