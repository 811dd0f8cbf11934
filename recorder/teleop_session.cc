#include "recorder/teleop_session.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "recorder/hand_keyframes.h"
#include "recorder/keyframes.h"

namespace flowscope {

void TeleopSession::restart(const World& world) {
  *this = TeleopSession();
  frames_.push_back(world.frame());
  hand_frames_.push_back(false);
}

void TeleopSession::keep(const Frame& frame) {
  if (!frames_.empty() && frame.time_s <= frames_.back().time_s) return;  // a script shows its start, too
  if (frames_.size() >= most_frames) {
    overflowed_ = true;
    return;
  }
  frames_.push_back(frame);
  hand_frames_.push_back(false);
  let_go_s_.reset();
}

void TeleopSession::keep_by_hand(const Frame& frame, double now_s) {
  const int before = frames();
  keep(frame);
  if (frames() == before) return;
  hand_frames_.back() = true;
  let_go_s_ = now_s;
}

void TeleopSession::begin_stroke(double now_s) {
  by_hand_ = true;
  const int now = frames() - 1;
  if (let_go_s_ && now_s - *let_go_s_ >= hand_rest_s && (rests_.empty() || rests_.back() < now)) {
    rests_.push_back(now);
  }
  if (!overflowed_) strokes_.push_back(frames_.size());
}

void TeleopSession::drop_empty_stroke() {
  if (!strokes_.empty() && strokes_.back() == frames_.size()) strokes_.pop_back();
}

bool TeleopSession::mark() {
  const int now = frames() - 1;
  if (now < 1 || overflowed_ || (!marks_.empty() && marks_.back() == now)) return false;
  marks_.push_back(now);
  return true;
}

bool TeleopSession::undo(World& world) {
  if (strokes_.empty()) return false;
  frames_.resize(strokes_.back());
  strokes_.pop_back();
  hand_frames_.resize(frames_.size());
  std::erase_if(marks_, [&](int index) { return index >= frames(); });
  std::erase_if(rests_, [&](int index) { return index >= frames(); });
  let_go_s_.reset();
  overflowed_ = false;
  // What ordered success terms latched on the way stays latched.
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (i == 0)
      world.restore(frames_[i].state);
    else
      world.follow(frames_[i].state);
  }
  return true;
}

std::vector<int> TeleopSession::keyframes() const {
  if (marks_.empty() && std::ranges::find(hand_frames_, char{true}) == hand_frames_.end())
    return keyframes_to_learn(frames_);
  if (marks_.empty()) return hand_keyframes(frames_, hand_frames_, rests_);
  std::vector<int> all = marks_;
  for (int i = 1; i < frames(); ++i) {
    if (frames_[i].gripper_open != frames_[i - 1].gripper_open) all.push_back(i);
  }
  all.push_back(frames() - 1);
  std::sort(all.begin(), all.end());
  // Two neighbours are one stop: the later one is where it ended.
  std::vector<int> apart;
  for (const int index : all) {
    if (!apart.empty() && index - apart.back() <= 1) apart.pop_back();
    apart.push_back(index);
  }
  return apart;
}

Demo TeleopSession::demo(const World& world, const Observe& observe) const {
  if (frames() < 2) throw std::logic_error("nothing has moved since the reset");
  if (overflowed_) throw std::logic_error("the session is longer than ten minutes");
  return make_demo(world, frames_, keyframes(), observe);
}

}  // namespace flowscope
