#include "recorder/model_sha256.h"

#include <mujoco/mujoco.h>

#include <cstdint>
#include <vector>

#include "recorder/sha256.h"

namespace flowscope {

std::string model_sha256(const mjModel* model) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(mj_sizeModel(model)));
  mj_saveModel(model, nullptr, bytes.data(), static_cast<int>(bytes.size()));
  return sha256_hex(bytes);
}

}  // namespace flowscope
