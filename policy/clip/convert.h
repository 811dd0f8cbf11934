// Brings the user's own copy of CLIP's published weights into our container (weights.h). The only place that
// reads foreign formats; it runs in a command, never in the server.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "policy/safetensors.h"

namespace flowscope {

struct ClipConvertOptions {
  std::filesystem::path image;   ///< empty: the container gets no image trunk
  std::filesystem::path text;    ///< empty: no text transformer; may be the same file as `image`
  std::filesystem::path merges;  ///< with `text`: bpe_simple_vocab_16e6.txt(.gz) or merges.txt
  std::filesystem::path out;
};

struct ClipConverted {
  std::string identity;                                    ///< as ClipEncoders::identity
  std::int64_t image_parameters = 0, text_parameters = 0;  ///< numbers stored
};

/// Weight files are OpenAI's TorchScript archives (RN50.pt for pictures, RN50.pt or ViT-B-32.pt for text) or
/// safetensors with the same names (text under "text.…" or under the transformers library's names is found
/// too); half precision becomes float32, whatever else the file holds is left out. Takes about three times
/// the memory of the larger file. Throws BadCheckpoint (policy/policy.h) "FILE: …" for a file that cannot be
/// read and for tensors that are missing or of another shape; std::invalid_argument for options that do not
/// fit together; std::system_error: the disk refused.
ClipConverted convert_clip(const ClipConvertOptions& options);

/// Every parameter and buffer of a TorchScript archive or safetensors file, by name. Throws BadCheckpoint.
TensorsByName read_foreign_weights(const std::filesystem::path& path);

/// Text of a merges file, gzip-packed or plain, cut behind the merges that CLIP uses. Throws BadCheckpoint.
std::string read_merges(const std::filesystem::path& path);

}  // namespace flowscope
