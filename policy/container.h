// The file that a policy lives in: named texts and tensors, checked to the last byte, never unpickled.
// Layout: 8-byte little-endian header length, JSON header (at most 1 MiB), raw little-endian tensor data one
// after the other, SHA-256 of all of that as 64 hex digits. Header:
// {"format":"flowscope-policy/1","text":{name: string},
// "tensors":[{"name","dtype":"f32|i64|u8","shape":[…],"offset"}]}; offsets count bytes from the end of the
// header.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "policy/torch_parts.h"

namespace flowscope {

struct NamedTensor {
  std::string name;
  torch::Tensor tensor;  ///< float32, int64 or uint8, on the CPU
};

struct Container {
  std::map<std::string, std::string> text;
  std::vector<NamedTensor> tensors;
};

/// Whole or absent (recorder/atomic_file.h). std::invalid_argument names the text or tensor that cannot be
/// stored; std::system_error: the disk refused.
void write_container(const std::filesystem::path& path, const Container& container);

/// Throws BadCheckpoint (policy/policy.h) naming file and place for anything that write_container would not
/// have written. Reserves no more memory than the file is long. Whether names, shapes and values fit a model
/// is the caller's to check.
Container read_container(const std::filesystem::path& path);

}  // namespace flowscope
