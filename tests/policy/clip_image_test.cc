// The trunk and the pyramid against plain loops in double precision, with the batch norms written out.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>

#include "policy/clip/image_branch.h"
#include "tests/support/clip_weights.h"

namespace flowscope {
namespace {

using testing::random_weights;
using testing::Tensors;
using testing::trunk_shapes;
using testing::TrunkSizes;

/// One picture's feature map.
struct Map {
  std::int64_t channels, height, width;
  std::vector<double> data;
  Map(std::int64_t c, std::int64_t h, std::int64_t w) : channels(c), height(h), width(w), data(c * h * w) {}
  double& at(std::int64_t c, std::int64_t y, std::int64_t x) { return data[(c * height + y) * width + x]; }
  double at(std::int64_t c, std::int64_t y, std::int64_t x) const {
    return data[(c * height + y) * width + x];
  }
};

Map each(Map map, const std::function<double(double)>& f) {
  for (double& v : map.data) v = f(v);
  return map;
}

Map relu(Map map) {
  return each(std::move(map), [](double v) { return std::max(v, 0.0); });
}

Map sum(Map a, const Map& b) {
  for (std::size_t i = 0; i < a.data.size(); ++i) a.data[i] += b.data[i];
  return a;
}

Map convolve(const Map& x, const torch::Tensor& weight, std::int64_t stride) {
  const auto w = weight.accessor<float, 4>();
  const std::int64_t kernel = w.size(2), pad = kernel / 2;
  Map y(w.size(0), (x.height + 2 * pad - kernel) / stride + 1, (x.width + 2 * pad - kernel) / stride + 1);
  for (std::int64_t o = 0; o < y.channels; ++o)
    for (std::int64_t i = 0; i < y.height; ++i)
      for (std::int64_t j = 0; j < y.width; ++j)
        for (std::int64_t c = 0; c < x.channels; ++c)
          for (std::int64_t a = 0; a < kernel; ++a)
            for (std::int64_t b = 0; b < kernel; ++b) {
              const std::int64_t row = i * stride + a - pad, column = j * stride + b - pad;
              if (row < 0 || column < 0 || row >= x.height || column >= x.width) continue;
              y.at(o, i, j) += w[o][c][a][b] * x.at(c, row, column);
            }
  return y;
}

Map normalise(Map x, const Tensors& weights, const std::string& name) {
  const auto part = [&](const char* which) { return weights.at(name + "." + which).accessor<float, 1>(); };
  const auto scale = part("weight"), shift = part("bias"), mean = part("running_mean"),
             variance = part("running_var");
  for (std::int64_t c = 0; c < x.channels; ++c)
    for (std::int64_t y = 0; y < x.height; ++y)
      for (std::int64_t i = 0; i < x.width; ++i)
        x.at(c, y, i) = (x.at(c, y, i) - mean[c]) / std::sqrt(variance[c] + 1e-5) * scale[c] + shift[c];
  return x;
}

Map average(const Map& x, std::int64_t side) {
  Map y(x.channels, x.height / side, x.width / side);
  for (std::int64_t c = 0; c < x.channels; ++c)
    for (std::int64_t i = 0; i < y.height * side; ++i)
      for (std::int64_t j = 0; j < y.width * side; ++j)
        y.at(c, i / side, j / side) += x.at(c, i, j) / static_cast<double>(side * side);
  return y;
}

Map bottleneck(const Map& x, const Tensors& w, const std::string& at, std::int64_t stride) {
  const Map a = relu(normalise(convolve(x, w.at(at + "conv1.weight"), 1), w, at + "bn1"));
  const Map b = relu(normalise(convolve(a, w.at(at + "conv2.weight"), 1), w, at + "bn2"));
  const Map c = normalise(convolve(average(b, stride), w.at(at + "conv3.weight"), 1), w, at + "bn3");
  if (!w.contains(at + "downsample.0.weight")) return relu(sum(c, x));
  const Map around = convolve(average(x, stride), w.at(at + "downsample.0.weight"), 1);
  return relu(sum(c, normalise(around, w, at + "downsample.1")));
}

std::vector<Map> trunk(const torch::Tensor& picture, const Tensors& w, const TrunkSizes& sizes) {
  constexpr double mean[] = {0.48145466, 0.4578275, 0.40821073},
                   deviation[] = {0.26862954, 0.26130258, 0.27577711};
  const auto p = picture.accessor<float, 3>();
  Map x(3, p.size(1), p.size(2));
  for (std::int64_t c = 0; c < 3; ++c)
    for (std::int64_t i = 0; i < x.height; ++i)
      for (std::int64_t j = 0; j < x.width; ++j) x.at(c, i, j) = (p[c][i][j] - mean[c]) / deviation[c];
  for (const char* k : {"1", "2", "3"}) {
    const std::string number = k;
    x = relu(normalise(convolve(x, w.at("visual.conv" + number + ".weight"), number == "1" ? 2 : 1), w,
                       "visual.bn" + number));
  }
  std::vector<Map> taps{x};
  x = average(x, 2);
  for (std::size_t l = 0; l < sizes.blocks.size(); ++l) {
    for (int b = 0; b < sizes.blocks[l]; ++b)
      x = bottleneck(x, w, "visual.layer" + std::to_string(l + 1) + "." + std::to_string(b) + ".",
                     l > 0 && b == 0 ? 2 : 1);
    taps.push_back(x);
  }
  return taps;
}

// Largest difference over the largest value.
double difference(const Map& wanted, const torch::Tensor& found) {
  EXPECT_EQ(found.sizes(), (std::vector<std::int64_t>{wanted.channels, wanted.height, wanted.width}));
  const torch::Tensor flat = found.contiguous().flatten();
  double most = 0, scale = 1e-6;
  for (std::size_t i = 0; i < wanted.data.size(); ++i) {
    most = std::max(most, std::abs(wanted.data[i] - flat[static_cast<std::int64_t>(i)].item<double>()));
    scale = std::max(scale, std::abs(wanted.data[i]));
  }
  return most / scale;
}

TrunkSizes small_sizes() {
  return {.stem = 3, .stem_out = 5, .narrow = {2, 3, 3, 4}, .blocks = {2, 2, 1, 1}, .expansion = 2};
}

TEST(ClipResNet, GivesTheFeatureMapsOfPlainLoops) {
  const Tensors weights = random_weights(trunk_shapes(small_sizes()), 3);
  const ClipResNet resnet(weights);
  EXPECT_EQ(resnet.tap_channels(), (std::vector<std::int64_t>{5, 4, 6, 6, 8}));
  const torch::Tensor pictures = torch::rand({2, 3, 64, 96});
  const ClipTaps taps = resnet.forward(pictures);
  for (std::int64_t n = 0; n < 2; ++n) {
    const std::vector<Map> wanted = trunk(pictures[n], weights, small_sizes());
    for (std::size_t i = 0; i < taps.size(); ++i)
      EXPECT_LT(difference(wanted[i], taps[i][n]), 1e-5) << "tap " << i;
  }
}

TEST(ClipResNet, IsFrozen) {
  Tensors weights = random_weights(trunk_shapes(small_sizes()), 3);
  for (auto& [name, tensor] : weights) tensor.requires_grad_();
  const ClipResNet resnet(weights);
  const torch::Tensor pictures = torch::rand({1, 3, 32, 32}).requires_grad_();
  for (const torch::Tensor& tap : resnet.forward(pictures)) EXPECT_FALSE(tap.requires_grad());
}

TEST(ClipResNet, SaysWhatDoesNotFit) {
  const Tensors weights = random_weights(trunk_shapes(small_sizes()), 3);
  const auto complaint = [&](const std::string& name, const torch::Tensor& tensor) -> std::string {
    Tensors changed = weights;
    changed.erase(name);
    if (tensor.defined()) changed[name] = tensor;
    try {
      ClipResNet resnet(changed);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint("visual.layer3.0.bn2.bias", {}), "tensor visual.layer3.0.bn2.bias is missing");
  EXPECT_NE(complaint("visual.layer2.0.conv3.weight", torch::zeros({6, 4, 1, 1})).find("[6, 4, 1, 1]"),
            std::string::npos);
  const ClipResNet resnet(weights);
  EXPECT_THROW(resnet.forward(torch::rand({1, 3, 48, 64})), std::invalid_argument);
  EXPECT_THROW(resnet.forward(torch::rand({1, 4, 64, 64})), std::invalid_argument);
  EXPECT_THROW(resnet.forward(torch::zeros({1, 3, 64, 64}, torch::kUInt8)), std::invalid_argument);
}

TEST(ClipPyramid, UsesTheLevelWith32Cells) {
  EXPECT_EQ(pyramid_level(128, 128), 1);
  EXPECT_EQ(pyramid_level(256, 256), 2);
  EXPECT_EQ(pyramid_level(192, 256), 1);
  EXPECT_EQ(pyramid_level(512, 512), 3);
  EXPECT_EQ(pyramid_level(64, 64), 1);
}

Map map_of(const torch::Tensor& t) {
  Map map(t.size(0), t.size(1), t.size(2));
  const torch::Tensor flat = t.contiguous().flatten();
  for (std::size_t i = 0; i < map.data.size(); ++i)
    map.data[i] = flat[static_cast<std::int64_t>(i)].item<double>();
  return map;
}

Map with_bias(Map map, const torch::Tensor& bias) {
  for (std::int64_t c = 0; c < map.channels; ++c)
    for (std::int64_t i = 0; i < map.height * map.width; ++i)
      map.data[c * map.height * map.width + i] += bias[c].item<double>();
  return map;
}

TEST(ClipPyramid, AddsWhatTheCoarseLevelsKnow) {
  torch::manual_seed(5);
  const std::vector<std::int64_t> channels{2, 3, 4, 5, 6};
  ClipPyramid pyramid(channels, 3);
  const auto parameters = pyramid->named_parameters();
  const torch::NoGradGuard no_grad;
  for (const auto& item : parameters) item.value().normal_();
  ClipTaps taps;
  for (int i = 0; i < 5; ++i) taps[i] = torch::randn({1, channels[i], 32 >> i, 64 >> i});
  for (const int level : {1, 2, 4}) {
    const auto part = [&](const char* name, int at, const char* which) {
      return parameters[name + std::to_string(at) + "." + which];
    };
    Map sum_so_far(0, 0, 0);
    for (int at = 4; at >= level; --at) {
      Map own = with_bias(convolve(map_of(taps[at][0]), part("lateral", at, "weight"), 1),
                          part("lateral", at, "bias"));
      if (at < 4) {
        for (std::int64_t c = 0; c < own.channels; ++c)
          for (std::int64_t y = 0; y < own.height; ++y)
            for (std::int64_t x = 0; x < own.width; ++x) own.at(c, y, x) += sum_so_far.at(c, y / 2, x / 2);
      }
      sum_so_far = own;
    }
    const Map wanted =
        with_bias(convolve(sum_so_far, part("smooth", level, "weight"), 1), part("smooth", level, "bias"));
    EXPECT_LT(difference(wanted, pyramid->forward(taps, level)[0]), 1e-5) << "level " << level;
  }
  EXPECT_THROW(pyramid->forward(taps, 0), std::invalid_argument);
  EXPECT_THROW(pyramid->forward(ClipTaps{}, 1), std::invalid_argument);
}

TEST(ClipImageBranch, GathersBilinearlyInTheRightPicture) {
  torch::manual_seed(6);
  constexpr std::int64_t scenes = 2, views = 3, h = 4, w = 6, height = 16, width = 24, tokens = 50;
  const torch::Tensor maps = torch::randn({scenes * views, 5, h, w}).requires_grad_();
  torch::Tensor place = torch::rand({scenes, tokens, 3}) * torch::tensor({3.f, 24.f, 16.f});
  place.select(2, 0).floor_();
  const torch::Tensor found = gather_features(maps, place, height, width);
  const torch::Tensor weight = torch::randn_like(found);
  const torch::Tensor gradient = torch::autograd::grad({(found * weight).sum()}, {maps})[0];

  // Another operator of bilinear reading, one token at a time.
  const torch::Tensor reference_maps = maps.detach().clone().requires_grad_();
  std::vector<torch::Tensor> rows;
  for (std::int64_t s = 0; s < scenes; ++s) {
    for (std::int64_t i = 0; i < tokens; ++i) {
      const torch::Tensor at = place[s][i];
      const torch::Tensor grid =
          torch::stack({at[1] * (2.0 / width) - 1, at[2] * (2.0 / height) - 1}).view({1, 1, 1, 2});
      const torch::Tensor map = reference_maps[s * views + at[0].item<std::int64_t>()].unsqueeze(0);
      rows.push_back(
          torch::grid_sampler(map, grid, /*bilinear*/ 0, /*border*/ 1, /*align_corners=*/false).flatten());
    }
  }
  const torch::Tensor wanted = torch::stack(rows).view({scenes, tokens, 5});
  EXPECT_TRUE(torch::allclose(found, wanted, 1e-4, 1e-5));
  EXPECT_TRUE(torch::allclose(gradient, torch::autograd::grad({(wanted * weight).sum()}, {reference_maps})[0],
                              1e-4, 1e-5));
}

TEST(ClipImageBranch, GivesACellItsOwnFeatureAtItsCentre) {
  const torch::Tensor maps = torch::randn({2, 3, 4, 4});
  const torch::Tensor place = torch::tensor({1.f, 4 * 2.5f, 4 * 1.5f}).view({1, 1, 3});
  EXPECT_TRUE(torch::equal(gather_features(maps, place, 16, 16)[0][0], maps.permute({0, 2, 3, 1})[1][1][2]));
}

TEST(ClipImageBranch, TeachesThePyramidAndNothingElse) {
  const auto resnet = std::make_shared<ClipResNet>(random_weights(trunk_shapes(small_sizes()), 3));
  torch::manual_seed(7);
  ClipImageBranch branch(resnet, 8);
  for (const auto& item : branch->named_parameters())
    EXPECT_EQ(item.key().rfind("pyramid.", 0), 0u) << item.key();
  EXPECT_TRUE(branch->named_buffers().is_empty());
  const torch::Tensor pictures = torch::rand({4, 3, 128, 128}).requires_grad_();
  const torch::Tensor place = torch::tensor({{0.f, 3.5f, 100.5f}, {1.f, 64.f, 64.f}}).repeat({2, 1, 1});
  const torch::Tensor tokens = branch->forward(pictures, place);
  EXPECT_EQ(tokens.sizes(), (std::vector<std::int64_t>{2, 2, 8}));
  EXPECT_TRUE(torch::equal(tokens, branch->from_taps(resnet->forward(pictures), place)));
  tokens.square().sum().backward();
  EXPECT_FALSE(pictures.grad().defined());
  const auto parameters = branch->named_parameters();
  for (const char* used : {"lateral1", "lateral2", "lateral3", "lateral4", "smooth1"})
    EXPECT_GT(parameters["pyramid." + std::string(used) + ".weight"].grad().abs().sum().item<double>(), 0)
        << used;
  EXPECT_FALSE(parameters["pyramid.smooth2.weight"].grad().defined());
}

TEST(ClipImageBranch, SaysWhatDoesNotFit) {
  const torch::Tensor maps = torch::randn({4, 3, 4, 4});
  EXPECT_THROW(gather_features(maps, torch::zeros({3, 5, 3}), 16, 16), std::invalid_argument);
  EXPECT_THROW(gather_features(maps, torch::zeros({2, 5, 2}), 16, 16), std::invalid_argument);
  EXPECT_THROW(gather_features(maps, torch::full({2, 5, 3}, 2.f), 16, 16), std::invalid_argument);
  EXPECT_THROW(ClipImageBranch(nullptr, 8), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
