// What a glTF file needs that is not read, and what it uses that is lost.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace flowscope {

using TellLoss = std::function<void(const std::string&)>;

/// Throws BadGltf naming the first extension that the file requires and that would change its shape in ways
/// not known here. Tells the others that are used, declared or not, and not taken over.
void check_extensions(const nlohmann::json& root, const TellLoss& tell);
/// Tells of what the format has and a rigid object of one texture has not: animations, skins, further maps.
void tell_losses(const nlohmann::json& root, const TellLoss& tell);

}  // namespace flowscope
