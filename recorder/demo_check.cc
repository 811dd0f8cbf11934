#include "recorder/demo_check.h"

#include <algorithm>
#include <cmath>

#include "recorder/demo_twin.h"
#include "recorder/instruction.h"

namespace flowscope {
namespace {

// Between two frames a joint travels as far as some speed between the two recorded ones takes it. Contacts
// change speeds within a frame: of 29 recordings of 15 tasks none was off by more than 0.0072 rad in a frame,
// nor by more than 0.076 rad in a second by the trapezoid rule.
constexpr double kTravelTolerance_rad = 0.03;
constexpr double kDriftTolerance_rad = 0.2;
constexpr std::size_t kDriftFrames = 20;

bool usable(const Pose& pose) {
  return pose.position.allFinite() && std::abs(pose.rotation.norm() - 1) < 1e-6;
}

/// One colour all over: the renderer did not draw.
bool is_constant(const ImageRgb& image) {
  for (std::size_t i = 3; i < image.data.size(); ++i) {
    if (image.data[i] != image.data[i - 3]) return false;
  }
  return true;
}

std::string find_bad_picture(const Observation& observation, const std::string& place) {
  if (observation.views.empty()) return place + " has no picture";
  for (const View& view : observation.views) {
    const std::string where = place + ", view " + view.camera.name;
    if (view.rgb.data.empty() || is_constant(view.rgb)) return where + ": the picture has one colour";
    if (std::none_of(view.depth.data.begin(), view.depth.data.end(), [](float z) { return z > 0; })) {
      return where + ": no pixel has a depth";
    }
  }
  return {};
}

std::string find_bad_frame(const std::vector<Frame>& frames) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string place = "frame " + std::to_string(i);
    if (i > 0 && !(frames[i].time_s > frames[i - 1].time_s)) return place + ": time does not advance";
    if (!usable(frames[i].world_from_tool)) return place + ": the tool pose is not one";
    const auto is_finite = [](double value) { return std::isfinite(value); };
    if (!std::all_of(frames[i].q.begin(), frames[i].q.end(), is_finite) ||
        !std::all_of(frames[i].dq.begin(), frames[i].dq.end(), is_finite)) {
      return place + ": a joint value is not finite";
    }
  }
  return {};
}

double travel(const Frame& from, const Frame& to, std::size_t joint) { return to.q[joint] - from.q[joint]; }

/// Do the recorded joint speeds tell the same story as the recorded positions?
std::string find_bad_speed(const std::vector<Frame>& frames) {
  const auto place = [](std::size_t frame, std::size_t joint) {
    return "frame " + std::to_string(frame) + ", joint " + std::to_string(joint) + ": ";
  };
  for (std::size_t joint = 0; joint < frames.front().q.size(); ++joint) {
    std::vector<double> drift{0};  // summed over all frames so far, rad
    for (std::size_t i = 1; i < frames.size(); ++i) {
      const double dt = frames[i].time_s - frames[i - 1].time_s;
      const auto [low, high] = std::minmax(frames[i - 1].dq[joint], frames[i].dq[joint]);
      const double moved = travel(frames[i - 1], frames[i], joint);
      if (moved < low * dt - kTravelTolerance_rad || moved > high * dt + kTravelTolerance_rad) {
        return place(i, joint) + "jumps by " + std::to_string(moved) + " rad in " + std::to_string(dt) +
               " s at a speed of " + std::to_string(low) + " to " + std::to_string(high) + " rad/s";
      }
      drift.push_back(drift.back() + moved - dt * (low + high) / 2);
      const double late = drift[i] - drift[i - std::min(i, kDriftFrames)];
      if (std::abs(late) > kDriftTolerance_rad) {
        return place(i, joint) + "positions and speeds disagree by " + std::to_string(late) +
               " rad over the last second";
      }
    }
  }
  return {};
}

std::string find_bad_state(const std::vector<Frame>& frames) {
  const auto is_finite = [](const auto& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const SceneState& s = frames[i].state;
    if (!std::isfinite(frames[i].openness) || !is_finite(s.qpos) || !is_finite(s.qvel) ||
        !is_finite(s.mocap_pos) || !is_finite(s.mocap_quat)) {
      return "frame " + std::to_string(i) + ": a number of the state is not finite";
    }
  }
  return {};
}

/// How far a point lies outside a box, along the axis in which it is farthest out.
double distance_outside(const Box& box, const Eigen::Vector3d& p) {
  return std::max(0.0, (box.min - p).cwiseMax(p - box.max).maxCoeff());
}

std::string find_bad_keyframe(const Demo& demo) {
  int previous = 0;
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    const Keyframe& keyframe = demo.keyframes[k];
    const std::string place = "keyframe " + std::to_string(k);
    if (keyframe.frame <= previous || keyframe.frame >= static_cast<int>(demo.frames.size())) {
      return place + ": frame " + std::to_string(keyframe.frame) + " is out of order";
    }
    previous = keyframe.frame;
    const GripperAction& action = keyframe.action;
    if (!usable(action.world_from_tool) || !(action.openness >= 0 && action.openness <= 1)) {
      return place + ": the action is not one";
    }
    const double outside_m = distance_outside(demo.bounds, action.world_from_tool.position);
    if (outside_m > most_outside_m) {
      return place + ": the tool is " + std::to_string(std::lround(1000 * outside_m)) +
             " mm outside the task's box";
    }
    if (std::string problem = find_bad_picture(keyframe.observation, place); !problem.empty()) return problem;
  }
  if (previous != static_cast<int>(demo.frames.size()) - 1) return "the last keyframe is not the last frame";
  return {};
}

}  // namespace

std::string find_incoherence(const Demo& demo) {
  if (demo.frames.size() < 2) return "fewer than two frames";
  if (demo.keyframes.empty()) return "no keyframe";
  if (demo.info.task.empty()) return "no task";
  if (demo.info.instruction.empty()) return "no instruction";
  if (!has_word(demo.info.instruction)) return "the instruction holds no word";
  if (!(demo.bounds.min.array() < demo.bounds.max.array()).all()) return "the bounds are not a box";
  if (std::string problem = find_bad_frame(demo.frames); !problem.empty()) return problem;
  if (std::string problem = find_bad_state(demo.frames); !problem.empty()) return problem;
  if (std::string problem = find_bad_speed(demo.frames); !problem.empty()) return problem;
  if (std::string problem = find_bad_picture(demo.start, "start"); !problem.empty()) return problem;
  return find_bad_keyframe(demo);
}

std::string DemoJudge::find_problem(const std::string& id, const Demo& demo) {
  if (std::string problem = find_incoherence(demo); !problem.empty()) return problem;
  const auto [first, is_new] = by_motion_.emplace(motion_sha256(demo), id);
  return is_new || first->second == id ? "" : twin_text(first->second);
}

void DemoJudge::forget(const std::string& id) {
  std::erase_if(by_motion_, [&](const auto& known) { return known.second == id; });
}

}  // namespace flowscope
