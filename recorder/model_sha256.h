// Fingerprint of a compiled scene.
#pragma once

#include <string>

struct mjModel_;

namespace flowscope {

/// SHA-256 of everything in the model: bodies, meshes, pictures, names. The same files, compiled by the same
/// simulator, give the same one, wherever they lie.
std::string model_sha256(const mjModel_* model);

}  // namespace flowscope
