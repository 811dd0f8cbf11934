// A hand on the keys: the tool moved by wanted speeds, one recorded frame at a time.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "recorder/world.h"

namespace flowscope {

struct JogCommand {
  Eigen::Vector3d linear_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rad_s = Eigen::Vector3d::Zero();  ///< about axes through the tool point
  bool in_tool_frame = false;                               ///< else the world's axes
  bool may_touch = false;  ///< push on what is in the way; else stop a millimetre into it
  bool moves() const { return !linear_m_s.isZero() || !angular_rad_s.isZero(); }
};
inline constexpr double jog_limit_m_s = 0.25, jog_limit_rad_s = 1.2;  ///< of any axis

enum class JogState { still, moving, blocked, unreachable };
const char* to_string(JogState state);

struct JogStep {
  JogState state = JogState::still;
  std::string message;         ///< for people, when blocked or unreachable: by what
  std::optional<Frame> frame;  ///< empty when nothing was simulated
};

/// Moves the arm of one world until somebody else moves it; then make another. The world must outlive it. The
/// tool's speed ramps up and down; every step is solved exactly or not taken; joints keep
/// within their limits of place and speed. Throws SimulationFailed as the world does.
class Jogger {
 public:
  /// Throws std::runtime_error for a scene without a robot.
  explicit Jogger(World& world);
  ~Jogger();
  Jogger(Jogger&&) noexcept;
  Jogger& operator=(Jogger&&) noexcept;

  /// One frame. No command: slows down and then holds still; at rest nothing is simulated. Commands beyond
  /// the limits are cut to them.
  JogStep step(const JogCommand& command);
  bool at_rest() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope
