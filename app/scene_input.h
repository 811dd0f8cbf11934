// From a scene to what a policy takes in, and from its trace back to the scene: the same for the page,
// predict and eval.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "policy/policy.h"
#include "recorder/demo.h"
#include "recorder/record.h"
#include "recorder/task.h"

namespace flowscope {

/// What the policy sees before keyframe `k` (0-based) of a demonstration. Throws std::out_of_range.
PolicyInput input_of(const Demo& demo, int k);
RobotState robot_of(const Frame& frame);

/// Fingerprint of a state: two scenes with the same one look and behave alike.
std::string state_sha256(const SceneState& state);

/// The expert's keyframes of any scene, found by running the task's own demonstration in a world apart. Kept
/// per scene. Any thread; the first call for a scene takes about a second.
class ExpertBook {
 public:
  explicit ExpertBook(const TaskLibrary& tasks) : tasks_(tasks) {}
  /// None when the expert fails there or has fewer keyframes, or was stopped on the way.
  std::optional<GripperAction> keyframe(const std::string& task, int variation, std::uint64_t seed, int k,
                                        std::stop_token stop = {});

 private:
  using Scene = std::tuple<std::string, int, std::uint64_t>;
  const TaskLibrary& tasks_;
  std::mutex mutex_;
  std::map<Scene, std::vector<GripperAction>> known_;
};

}  // namespace flowscope
