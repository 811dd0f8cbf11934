// Weights with CLIP's published names, listed here a second time and by other means than the program's own
// list, and small ones of the same kind that plain loops can follow.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "policy/torch_parts.h"

namespace flowscope::testing {

using Tensors = std::map<std::string, torch::Tensor>;
using Shapes = std::map<std::string, std::vector<std::int64_t>>;

/// Stem and blocks of a trunk "visual.…". `narrow`: of each layer; a block gives `expansion` times as many
/// channels.
struct TrunkSizes {
  std::int64_t stem = 32, stem_out = 64;
  std::vector<std::int64_t> narrow{64, 128, 256, 512};
  std::vector<int> blocks{3, 4, 6, 3};
  std::int64_t expansion = 4;
};

inline Shapes trunk_shapes(const TrunkSizes& sizes = {}) {
  Shapes out;
  const auto norm = [&](const std::string& name, std::int64_t channels) {
    out[name + ".weight"] = out[name + ".bias"] = out[name + ".running_mean"] =
        out[name + ".running_var"] = {channels};
  };
  out["visual.conv1.weight"] = {sizes.stem, 3, 3, 3};
  norm("visual.bn1", sizes.stem);
  out["visual.conv2.weight"] = {sizes.stem, sizes.stem, 3, 3};
  norm("visual.bn2", sizes.stem);
  out["visual.conv3.weight"] = {sizes.stem_out, sizes.stem, 3, 3};
  norm("visual.bn3", sizes.stem_out);
  std::int64_t in = sizes.stem_out;
  for (std::size_t l = 0; l < sizes.narrow.size(); ++l) {
    for (int b = 0; b < sizes.blocks[l]; ++b) {
      const std::string at = "visual.layer" + std::to_string(l + 1) + "." + std::to_string(b);
      const std::int64_t n = sizes.narrow[l], wide = n * sizes.expansion;
      out[at + ".conv1.weight"] = {n, in, 1, 1};
      norm(at + ".bn1", n);
      out[at + ".conv2.weight"] = {n, n, 3, 3};
      norm(at + ".bn2", n);
      out[at + ".conv3.weight"] = {wide, n, 1, 1};
      norm(at + ".bn3", wide);
      if (b == 0) {
        out[at + ".downsample.0.weight"] = {wide, in, 1, 1};
        norm(at + ".downsample.1", wide);
      }
      in = wide;
    }
  }
  return out;
}

inline Shapes text_shapes(std::int64_t width = 512, int blocks = 12, std::int64_t vocabulary = 49408,
                          std::int64_t context = 77) {
  Shapes out;
  out["token_embedding.weight"] = {vocabulary, width};
  out["positional_embedding"] = {context, width};
  out["ln_final.weight"] = out["ln_final.bias"] = {width};
  for (int b = 0; b < blocks; ++b) {
    const std::string at = "transformer.resblocks." + std::to_string(b);
    out[at + ".attn.in_proj_weight"] = {3 * width, width};
    out[at + ".attn.in_proj_bias"] = {3 * width};
    out[at + ".attn.out_proj.weight"] = {width, width};
    out[at + ".mlp.c_fc.weight"] = {4 * width, width};
    out[at + ".mlp.c_fc.bias"] = {4 * width};
    out[at + ".mlp.c_proj.weight"] = {width, 4 * width};
    for (const char* name : {".attn.out_proj.bias", ".mlp.c_proj.bias", ".ln_1.weight", ".ln_1.bias",
                             ".ln_2.weight", ".ln_2.bias"})
      out[at + name] = {width};
  }
  return out;
}

/// The rest of what OpenAI's archive of its ResNet-50 holds.
inline Shapes unused_shapes() {
  Shapes out{{"logit_scale", {}}, {"text_projection", {512, 1024}}, {"visual.bn1.num_batches_tracked", {}}};
  out["visual.attnpool.positional_embedding"] = {50, 2048};
  for (const char* name : {"q_proj", "k_proj", "v_proj"}) {
    out[std::string("visual.attnpool.") + name + ".weight"] = {2048, 2048};
    out[std::string("visual.attnpool.") + name + ".bias"] = {2048};
  }
  out["visual.attnpool.c_proj.weight"] = {1024, 2048};
  out["visual.attnpool.c_proj.bias"] = {1024};
  return out;
}

/// One value per tensor, a different one for each, exact in half precision.
inline Tensors filled(const Shapes& shapes, torch::ScalarType type = torch::kFloat32) {
  Tensors out;
  int k = 0;
  for (const auto& [name, shape] : shapes) out[name] = torch::full(shape, (++k % 61 + 1) / 4096.0, type);
  return out;
}

/// Random, of a size at which signals neither die nor explode. Variances are positive, no norm is the
/// identity.
inline Tensors random_weights(const Shapes& shapes, std::uint64_t seed) {
  torch::manual_seed(seed);
  Tensors out;
  for (const auto& [name, shape] : shapes) {
    const torch::Tensor noise = torch::randn(shape);
    if (name.ends_with("running_var") || (shape.size() == 1 && name.ends_with("weight")))
      out[name] = 1 + 0.5 * noise.tanh();
    else if (shape.size() > 1)
      out[name] = noise * std::sqrt(1.5 / static_cast<double>(noise[0].numel()));
    else
      out[name] = 0.3 * noise;
  }
  return out;
}

}  // namespace flowscope::testing
