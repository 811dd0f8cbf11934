#include "policy/clip/pyramid.h"

#include <algorithm>
#include <stdexcept>

namespace flowscope {
namespace {

constexpr int finest = 1, coarsest = 4;
constexpr std::int64_t cells_a_side = 32;

// Uniform with variance 1 / fan_in and no offset, as the pyramid's authors' code starts.
void initialise(torch::nn::Conv2d& conv) {
  torch::nn::init::kaiming_uniform_(conv->weight, 1.0);
  torch::nn::init::zeros_(conv->bias);
}

}  // namespace

int pyramid_level(std::int64_t height, std::int64_t width) {
  int level = coarsest;
  while (level > finest && std::min(height, width) >> (level + 1) < cells_a_side) --level;
  return level;
}

ClipPyramidImpl::ClipPyramidImpl(const std::vector<std::int64_t>& tap_channels, std::int64_t channels) {
  if (tap_channels.size() != coarsest + 1)
    throw std::invalid_argument("clip pyramid: there must be " + std::to_string(coarsest + 1) + " taps");
  for (int level = finest; level <= coarsest; ++level) {
    const std::string at = std::to_string(level);
    lateral_.push_back(register_module(
        "lateral" + at, torch::nn::Conv2d(torch::nn::Conv2dOptions(tap_channels[level], channels, 1))));
    smooth_.push_back(register_module(
        "smooth" + at, torch::nn::Conv2d(torch::nn::Conv2dOptions(channels, channels, 3).padding(1))));
    initialise(lateral_.back());
    initialise(smooth_.back());
  }
}

torch::Tensor ClipPyramidImpl::forward(const ClipTaps& taps, int level) {
  if (level < finest || level > coarsest) {
    throw std::invalid_argument("clip pyramid: level " + std::to_string(level) + " is not " +
                                std::to_string(finest) + " to " + std::to_string(coarsest));
  }
  torch::Tensor sum;
  for (int at = coarsest; at >= level; --at) {
    const torch::nn::Conv2d& lateral = lateral_[at - finest];
    const torch::Tensor& tap = taps[at];
    if (!tap.defined() || tap.dim() != 4 || tap.size(1) != lateral->weight.size(1))
      throw std::invalid_argument("clip pyramid: tap " + std::to_string(at) + " must be [N, " +
                                  std::to_string(lateral->weight.size(1)) + ", h, w]");
    const torch::Tensor own = torch::conv2d(tap, lateral->weight, lateral->bias);
    sum = sum.defined() ? own + torch::upsample_nearest2d(sum, own.sizes().slice(2)) : own;
  }
  return smooth_[level - finest]->forward(sum);
}

}  // namespace flowscope
