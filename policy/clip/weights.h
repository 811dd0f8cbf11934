// CLIP's frozen encoders on disk: our own checked container (policy/container.h), written once from the
// user's copy of the published weights (convert.h). Texts: "kind" = "clip/1", "identity". Tensors: float32
// under their published names (published.h), the image trunk, the text transformer or both; with the text
// also "merges", uint8, the tokenizer's pairs one per line.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "policy/clip/resnet.h"
#include "policy/clip/text_encoder.h"
#include "policy/clip/tokenizer.h"

namespace flowscope {

/// Shared and immutable: one copy serves every network of the program.
struct ClipEncoders {
  std::shared_ptr<const ClipResNet> image;         ///< null when the file holds no image trunk
  std::shared_ptr<const ClipTextEncoder> text;     ///< null when it holds no text transformer
  std::shared_ptr<const ClipTokenizer> tokenizer;  ///< with `text`
  std::string
      identity;  ///< SHA-256 over names, shapes, values and merges: a policy learnt on these, no others
};

/// Throws BadCheckpoint (policy/policy.h) naming file and place for a damaged file, another kind of container
/// and tensors that are missing or do not have their published shape.
ClipEncoders read_clip(const std::filesystem::path& path, torch::Device device = torch::kCPU);

/// `image` and `text` as published.h lists them, either may be empty; other tensors in them are left out.
/// Returns the identity. Throws std::invalid_argument naming a tensor that is missing or does not fit;
/// std::system_error: the disk refused.
std::string write_clip(const std::filesystem::path& path, const TensorsByName& image,
                       const TensorsByName& text, std::string_view merges);

}  // namespace flowscope
