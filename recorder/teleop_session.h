// Everything that moved since the last reset: what can be undone, and what becomes a demonstration.
#pragma once

#include <optional>
#include <vector>

#include "recorder/record.h"
#include "recorder/world.h"

namespace flowscope {

/// A plain value beside one world; whoever owns the world keeps it up to date.
class TeleopSession {
 public:
  static constexpr std::size_t most_frames = 12'000;  ///< ten minutes

  /// After every reset of the world.
  void restart(const World& world);
  /// Every recorded frame of any motion, states and all.
  void keep(const Frame& frame);
  /// The same of a movement by hand. `now_s`: when, of any clock that goes on while the world stands still.
  void keep_by_hand(const Frame& frame, double now_s);
  /// Before a movement by hand starts: undo() comes back to here.
  void begin_stroke(double now_s);
  /// Nothing came of it.
  void drop_empty_stroke();
  /// Marks the present moment as a keyframe; false when it is one already or nothing has moved yet.
  bool mark();
  /// Takes the last movement by hand back; what scripts did after it goes with it. False when there is none.
  bool undo(World& world);

  int strokes() const { return static_cast<int>(strokes_.size()); }
  int frames() const { return static_cast<int>(frames_.size()); }
  int marks() const { return static_cast<int>(marks_.size()); }
  bool moved_by_hand() const { return by_hand_; }
  /// Whether `time_s` is where it has come to: the world moved on with it and was not set up anew. Also when
  /// it overflowed.
  bool holds(double time_s) const { return !frames_.empty() && time_s >= frames_.back().time_s; }
  /// More frames than are kept: no demonstration can be made of this.
  bool overflowed() const { return overflowed_; }

  /// Keyframes as they would be saved: hand-marked ones with every change of the gripper and the end; without
  /// marks those of hand_keyframes.h, or of the benchmark's rule when nothing was moved by hand.
  std::vector<int> keyframes() const;
  /// Throws std::logic_error when nothing has moved or too much did.
  Demo demo(const World& world, const Observe& observe) const;

 private:
  std::vector<Frame> frames_;
  std::vector<char> hand_frames_;     ///< for each frame: moved to by hand
  std::vector<int> rests_;            ///< frames at which the hand then let go for long, ascending
  std::optional<double> let_go_s_;    ///< when the last frame by hand was kept, while nothing else followed
  std::vector<int> marks_;            ///< indices of frames, ascending
  std::vector<std::size_t> strokes_;  ///< number of frames before each movement by hand
  bool overflowed_ = false, by_hand_ = false;
};

}  // namespace flowscope
