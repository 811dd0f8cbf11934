#include "policy/clip/resnet.h"

#include <sstream>
#include <stdexcept>

#include "policy/clip/published.h"

namespace flowscope {
namespace {

constexpr double norm_epsilon = 1e-5;
constexpr std::int64_t coarsest_stride = 32;

torch::Tensor per_channel(std::initializer_list<float> values, torch::Device device) {
  return torch::tensor(std::vector<float>(values)).view({1, -1, 1, 1}).to(device);
}

torch::Tensor pool(const torch::Tensor& x, std::int64_t stride) {
  return stride == 1 ? x : torch::avg_pool2d(x, stride);
}

}  // namespace

ClipResNet::Conv ClipResNet::load(const TensorsByName& weights, const std::string& conv,
                                  const std::string& norm, std::int64_t from, std::int64_t kernel,
                                  torch::Device device) {
  const torch::Tensor weight = clip_tensor(weights, conv + ".weight", {-1, from, kernel, kernel});
  const auto statistic = [&](const char* part) {
    return clip_tensor(weights, norm + "." + part, {weight.size(0)}).to(torch::kFloat64);
  };
  const torch::Tensor scale = statistic("weight") / (statistic("running_var") + norm_epsilon).sqrt();
  const torch::Tensor bias = statistic("bias") - statistic("running_mean") * scale;
  return {.weight = (weight.to(torch::kFloat64) * scale.view({-1, 1, 1, 1})).to(device, torch::kFloat32),
          .bias = bias.to(device, torch::kFloat32)};
}

ClipResNet::ClipResNet(const TensorsByName& weights, torch::Device device)
    : mean_(per_channel({0.48145466f, 0.4578275f, 0.40821073f}, device)),
      deviation_(per_channel({0.26862954f, 0.26130258f, 0.27577711f}, device)) {
  std::int64_t from = 3;
  for (const char* k : {"1", "2", "3"}) {
    stem_.push_back(
        load(weights, std::string("visual.conv") + k, std::string("visual.bn") + k, from, 3, device));
    from = stem_.back().weight.size(0);
  }
  stem_.front().stride = 2;
  for (std::size_t layer = 0; layer < layers_.size(); ++layer) {
    const std::string prefix = "visual.layer" + std::to_string(layer + 1) + ".";
    for (int k = 0; k == 0 || weights.contains(prefix + std::to_string(k) + ".conv1.weight"); ++k) {
      const std::string name = prefix + std::to_string(k) + ".";
      Block block;
      block.stride = layer > 0 && k == 0 ? 2 : 1;
      block.reduce = load(weights, name + "conv1", name + "bn1", from, 1, device);
      const std::int64_t narrow = block.reduce.weight.size(0);
      block.spatial = load(weights, name + "conv2", name + "bn2", narrow, 3, device);
      block.expand = load(weights, name + "conv3", name + "bn3", narrow, 1, device);
      const std::int64_t to = block.expand.weight.size(0);
      if (block.stride > 1 || from != to)
        block.shortcut.push_back(
            load(weights, name + "downsample.0", name + "downsample.1", from, 1, device));
      layers_[layer].push_back(std::move(block));
      from = to;
    }
  }
}

torch::Tensor ClipResNet::Conv::operator()(const torch::Tensor& x) const {
  return torch::conv2d(x, weight, bias, stride, weight.size(2) / 2);
}

torch::Tensor ClipResNet::Block::operator()(const torch::Tensor& x) const {
  const torch::Tensor narrow = spatial(reduce(x).relu_()).relu_();
  const torch::Tensor around = shortcut.empty() ? x : shortcut.front()(pool(x, stride));
  return expand(pool(narrow, stride)).add_(around).relu_();
}

ClipTaps ClipResNet::forward(const torch::Tensor& pictures) const {
  if (pictures.dim() != 4 || pictures.size(1) != 3 || pictures.scalar_type() != torch::kFloat32 ||
      pictures.size(2) % coarsest_stride != 0 || pictures.size(3) % coarsest_stride != 0 ||
      pictures.numel() == 0 || pictures.device() != device()) {
    std::ostringstream text;
    text << "clip trunk: pictures must be float32 [N, 3, H, W] on " << device()
         << " with H and W multiples of " << coarsest_stride << ", not " << pictures.toString() << " "
         << pictures.sizes();
    throw std::invalid_argument(text.str());
  }
  const torch::NoGradGuard frozen;
  ClipTaps taps;
  torch::Tensor x = (pictures - mean_) / deviation_;
  for (const Conv& conv : stem_) x = conv(x).relu_();
  taps[0] = x;
  x = pool(x, 2);
  for (std::size_t layer = 0; layer < layers_.size(); ++layer) {
    for (const Block& block : layers_[layer]) x = block(x);
    taps[layer + 1] = x;
  }
  return taps;
}

std::vector<std::int64_t> ClipResNet::tap_channels() const {
  std::vector<std::int64_t> channels{stem_.back().weight.size(0)};
  for (const auto& layer : layers_) channels.push_back(layer.back().expand.weight.size(0));
  return channels;
}

}  // namespace flowscope
