#include "app/scene_input.h"

#include <cstring>
#include <span>
#include <stdexcept>

#include "recorder/sha256.h"

namespace flowscope {

RobotState robot_of(const Frame& frame) { return {frame.world_from_tool, frame.openness, frame.q}; }

PolicyInput input_of(const Demo& demo, int k) {
  if (k < 0 || k >= static_cast<int>(demo.keyframes.size())) {
    throw std::out_of_range("demonstration " + demo.info.id + " has keyframes 0 to " +
                            std::to_string(demo.keyframes.size() - 1) + ", not " + std::to_string(k));
  }
  PolicyInput input;
  input.observation = k == 0 ? demo.start : demo.keyframes[k - 1].observation;
  input.instruction = demo.info.instruction;
  input.keyframe_index = k;
  input.robot = demo.info.origin.robot;
  input.history.push_back(robot_of(demo.frames.at(0)));
  for (int i = 0; i < k; ++i) input.history.push_back(robot_of(demo.frames.at(demo.keyframes[i].frame)));
  return input;
}

std::string state_sha256(const SceneState& state) {
  std::vector<std::uint8_t> bytes(state.scene.begin(), state.scene.end());
  auto append = [&](const auto& values) {
    const auto raw = std::as_bytes(std::span(values));
    const auto* begin = reinterpret_cast<const std::uint8_t*>(raw.data());
    bytes.insert(bytes.end(), begin, begin + raw.size());
  };
  append(state.qpos);
  append(state.qvel);
  append(state.act);
  append(state.mocap_pos);
  append(state.mocap_quat);
  append(state.eq_active);
  append(state.mat_rgba);
  return sha256_hex(bytes);
}

std::optional<GripperAction> ExpertBook::keyframe(const std::string& task, int variation, std::uint64_t seed,
                                                  int k, std::stop_token stop) {
  std::lock_guard lock(mutex_);
  const Scene scene{task, variation, seed};
  auto it = known_.find(scene);
  if (it == known_.end()) {
    World world(tasks_.get(task));
    world.reset(variation, seed);
    const RunReport report = run_script(
        world, world.episode().demonstration, [](const SceneState&) { return Observation{}; }, {}, stop);
    if (stop.stop_requested()) return std::nullopt;
    std::vector<GripperAction> actions;
    if (report.demo) {
      for (const auto& keyframe : report.demo->keyframes) actions.push_back(keyframe.action);
    }
    if (known_.size() > 200) known_.clear();
    it = known_.emplace(scene, std::move(actions)).first;
  }
  if (k < 0 || k >= static_cast<int>(it->second.size())) return std::nullopt;
  return it->second[k];
}

}  // namespace flowscope
