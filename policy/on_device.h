// Where the network learns: chosen at run time.
#pragma once

#include <string>

#include "policy/batch.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// "cpu", "cuda" or "cuda:1". Throws std::invalid_argument for another, or when this LibTorch or this machine
/// has no such device.
torch::Device device_of(const std::string& name);

/// The same batch there; nothing is copied when it is there already.
SceneBatch on_device(SceneBatch batch, const torch::Device& device);
DrawBatch on_device(DrawBatch batch, const torch::Device& device);

}  // namespace flowscope
