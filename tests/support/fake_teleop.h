// Teleoperation without a world: a table at z = 0.75 with one frame, a tool that goes where it is told.
#pragma once

#include <mutex>
#include <sstream>

#include "web/backend.h"

namespace flowscope::testing {

class FakeTeleop {
 public:
  web::PickAnswer pick(const CameraModel& camera, const web::PickRequest& request) const {
    const Eigen::Vector3d eye = camera.world_from_camera.position;
    const Eigen::Vector3d ray =
        camera.unproject(request.u * camera.width, request.v * camera.height, 1) - eye;
    const double depth = (table_z - eye.z()) / ray.z();
    if (!(depth > 0 && depth < camera.far_m))
      throw web::ApiError(404, "nothing_there", "there is nothing at that place of the picture");
    web::PickAnswer answer;
    answer.picked = {eye + depth * ray, Eigen::Vector3d::UnitZ(), "table", "top", 0, depth};
    for (const char* approach : {"above", "normal"}) {
      const Pose pose{answer.picked.point, down()};
      MoveStep move;
      move.frame_from_tool = pose;
      answer.proposals.push_back({approach, move, pose});
    }
    return answer;
  }
  std::vector<NamedFrame> frames() const {
    return {{"world", Pose{}}, {"tool", status_.world_from_tool}, {"button_1", {{0.25, 0.1, 0.75}, down()}}};
  }
  /// Knows only the positions of one-line moves in the world and gripper steps; enough for the page's cards.
  std::vector<PlacedStep> place(const std::string& script) const {
    std::vector<PlacedStep> steps;
    std::istringstream lines(script);
    std::string text;
    double openness = 1;
    for (int line = 1; std::getline(lines, text); ++line) {
      PlacedStep& step = steps.emplace_back();
      step.step.line = line;
      const auto list = [&](const std::string& key) {
        Eigen::Vector3d v = Eigen::Vector3d::Zero();
        const auto at = text.find(key + ": [");
        char comma = 0;
        if (at != std::string::npos)
          std::istringstream(text.substr(at + key.size() + 3)) >> v[0] >> comma >> v[1] >> comma >> v[2];
        return v;
      };
      if (text.find("- move:") != std::string::npos) {
        MoveStep move;
        move.frame_from_tool = {list("position"), down()};
        move.linear = text.find("path: linear") != std::string::npos;
        move.ignore_collisions = text.find("ignore_collisions: true") != std::string::npos;
        step.step.what = move;
        step.move = PlacedMove{move.frame_from_tool, Pose{}};
      } else if (const auto at = text.find("- gripper:"); at != std::string::npos) {
        openness = text.find("open", at + 10) != std::string::npos ? 1 : 0;
        step.step.what = GripperStep{openness};
      } else {
        steps.pop_back();
        continue;
      }
      step.openness = openness;
    }
    if (steps.empty() && !script.empty())
      throw web::ApiError(400, "bad_script", "script:1:1: 'steps' is empty", "script:1:1");
    return steps;
  }
  web::TeleopStatus status() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }
  web::TeleopStatus jog(const web::JogRequest& request) {
    const std::lock_guard lock(mutex_);
    const bool moves = !request.linear_m_s.isZero() || !request.angular_rad_s.isZero();
    if (moves && !moving_) ++status_.strokes;
    moving_ = moves;
    status_.by_hand = status_.by_hand || moves;
    status_.jog = moves ? "moving" : "still";
    status_.frames += moves;
    status_.world_from_tool.position += 0.05 * request.linear_m_s;
    return status_;
  }
  web::TeleopStatus gripper(double openness) {
    const std::lock_guard lock(mutex_);
    status_.openness = openness;
    ++status_.strokes;
    return status_;
  }
  web::TeleopStatus undo() {
    const std::lock_guard lock(mutex_);
    if (status_.strokes == 0) throw web::ApiError(409, "nothing_to_undo", "nothing was moved by hand");
    --status_.strokes;
    return status_;
  }
  std::vector<Step> mark() {
    const std::lock_guard lock(mutex_);
    ++status_.marks;
    MoveStep move;
    move.frame_from_tool = status_.world_from_tool;
    return {{move, 0}, {GripperStep{status_.openness}, 0}};
  }

 private:
  static constexpr double table_z = 0.75;
  static Eigen::Quaterniond down() { return {0, 1, 0, 0}; }

  mutable std::mutex mutex_;
  web::TeleopStatus status_{{{0.25, 0, 1.0}, down()}, 1, "still", "", 0, 0, 0, false, false};
  bool moving_ = false;
};

}  // namespace flowscope::testing
