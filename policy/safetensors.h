// Weights as other programs read them: the safetensors format, checked to the last byte.
// Layout: 8-byte little-endian header length, a JSON object of that length, raw little-endian data. The
// header maps a name to {"dtype","shape":[…],"data_offsets":[begin,end]}, offsets counting bytes from the end
// of the header, and may hold "__metadata__":{string: string}. Source: github.com/huggingface/safetensors,
// "Format".
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace at {
class Tensor;  // torch::Tensor; who only passes files on needs no torch
}

namespace flowscope {

using TensorsByName = std::map<std::string, at::Tensor>;
using TextByName = std::map<std::string, std::string>;

/// Dense tensors on the CPU. F32, F16, BF16 and F64 all arrive as float32; I64, I32, U8 and BOOL keep their
/// type. `metadata`, when given, receives the header's texts. One tensor is read at a time and none is
/// reserved before its bytes are known to be in the file. Throws BadCheckpoint (policy/policy.h) naming file
/// and place for an unknown dtype and for whatever the format forbids: a duplicate name, a shape that does
/// not fit its bytes, overlaps, holes, data that is missing or left over. Headers end at 16 MiB, shapes at 8
/// dimensions.
TensorsByName read_safetensors(const std::filesystem::path& path, TextByName* metadata = nullptr);

/// Whole or absent (recorder/atomic_file.h); the same content is the same file. Stores float32, int64 and
/// uint8. std::invalid_argument names the tensor or text that cannot be stored; std::system_error: the disk
/// refused.
void write_safetensors(const std::filesystem::path& path, const TensorsByName& tensors,
                       const TextByName& metadata = {});

}  // namespace flowscope
