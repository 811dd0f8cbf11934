#include "app/failure_overlay.h"

#include <sstream>

namespace flowscope {
namespace {

constexpr std::size_t kLine = 44;  ///< characters: fits beside a ghost in the middle of a small view

std::string in_short_lines(const std::string& text) {
  std::istringstream words(text);
  std::string result, line;
  for (std::string word; words >> word;) {
    if (!line.empty() && line.size() + 1 + word.size() > kLine) {
      result += line + "\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return result + line;
}

}  // namespace

Overlay overlay_of_failure(const Pose& world_from_tool, const std::string& reason) {
  Overlay overlay;
  Rgba red = palette::failure;
  red[3] = 0.75f;
  overlay.ghosts.push_back({world_from_tool, 1, red});
  overlay.frames.push_back({world_from_tool, 0.08, 1});
  const Eigen::Vector3d above = world_from_tool.position + Eigen::Vector3d(0, 0, 0.15);
  overlay.labels.push_back({above, in_short_lines(reason)});
  return overlay;
}

}  // namespace flowscope
