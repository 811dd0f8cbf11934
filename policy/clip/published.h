// The tensors of CLIP's frozen encoders by their published names, and how they are asked for. Source: arXiv
// 2103.00020; the names are those of OpenAI's release.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "policy/safetensors.h"
#include "policy/torch_parts.h"

namespace flowscope {

struct PublishedTensor {
  std::string name;
  std::vector<std::int64_t> shape;
};

/// ResNet-50 trunk "visual.…" without its attention pool, which gives one vector per picture and is not
/// needed.
std::vector<PublishedTensor> clip_image_tensors();
/// Text transformer of width 512 without its projection, which gives one vector per text. ViT-B/32, ViT-B/16
/// and ResNet-50 share these shapes.
std::vector<PublishedTensor> clip_text_tensors();

/// Throws std::invalid_argument "tensor NAME is missing" or "tensor NAME is [found], not [wanted]"; names the
/// first few of several.
void require_published(const TensorsByName& tensors, const std::vector<PublishedTensor>& wanted);

/// One tensor as float32; a size of -1 is free. Throws std::invalid_argument as above.
torch::Tensor clip_tensor(const TensorsByName& tensors, const std::string& name,
                          const std::vector<std::int64_t>& shape);

}  // namespace flowscope
