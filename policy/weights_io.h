// Trained weights out to other programs and in from them, as safetensors. Names, shapes and layouts:
// app/WEIGHTS.md.
#pragma once

#include <filesystem>

namespace flowscope {

/// Writes the weights that predict (the running mean), named as the network names its parameters, and in the
/// metadata "config" all else that a prediction needs. Throws BadCheckpoint for `policy` (policy/policy.h),
/// std::system_error when the disk refuses.
void export_weights(const std::filesystem::path& policy, const std::filesystem::path& safetensors);

/// The other way: a policy that predicts with these weights, and trains on from them with fresh moments.
/// Training rates that the config lacks are its preset's; a policy that reads with CLIP needs FLOWSCOPE_CLIP.
/// Throws BadCheckpoint naming the file and the part
/// of the config, or every tensor that is missing, unknown or of another shape, or not finite.
void import_weights(const std::filesystem::path& safetensors, const std::filesystem::path& policy);

}  // namespace flowscope
