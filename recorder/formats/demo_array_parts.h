// What writing and reading a demonstration as arrays share.
#pragma once

#include <algorithm>
#include <string>
#include <tuple>

#include "recorder/demo_header.h"
#include "recorder/formats/demo_arrays.h"

namespace flowscope {

/// Every vector of a state under its name.
inline constexpr auto state_parts = std::tuple(
    std::pair("qpos", &SceneState::qpos), std::pair("qvel", &SceneState::qvel),
    std::pair("act", &SceneState::act), std::pair("ctrl", &SceneState::ctrl),
    std::pair("qacc_warmstart", &SceneState::qacc_warmstart), std::pair("mocap_pos", &SceneState::mocap_pos),
    std::pair("mocap_quat", &SceneState::mocap_quat), std::pair("eq_active", &SceneState::eq_active),
    std::pair("eq_data", &SceneState::eq_data), std::pair("mat_rgba", &SceneState::mat_rgba));

template <typename Visitor>
void for_each_state_part(Visitor&& visit) {
  std::apply([&](const auto&... part) { (visit(std::string("state/") + part.first, part.second), ...); },
             state_parts);
}

/// Columns of joint arrays: the arm's joints, or all places where the file does not say how many it has.
inline std::size_t stored_joints(const DemoInfo& info) {
  return info.origin.joints > 0 ? static_cast<std::size_t>(info.origin.joints) : Frame().q.size();
}

/// Pictures are stacked, so every moment must have the same cameras.
template <typename Failure>
void require_same_cameras(const DemoHeader& header) {
  const auto& first = header.observations.front();
  for (const ViewLayout& view : first) {
    if (!is_plain_name(view.camera.name))
      throw Failure("camera \"" + view.camera.name + "\": not a plain name");
  }
  const auto same = [](const ViewLayout& a, const ViewLayout& b) {
    return a.camera.name == b.camera.name && a.camera.width == b.camera.width &&
           a.camera.height == b.camera.height;
  };
  for (std::size_t k = 1; k < header.observations.size(); ++k) {
    const auto& views = header.observations[k];
    if (!std::equal(views.begin(), views.end(), first.begin(), first.end(), same)) {
      throw Failure("keyframe " + std::to_string(k - 1) + ": its cameras are not those of the start");
    }
  }
}

}  // namespace flowscope
