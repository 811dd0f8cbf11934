// SimLoop: movements by hand.
#include "app/sim_loop.h"
#include "recorder/pick.h"

namespace flowscope {
namespace {
constexpr std::chrono::milliseconds kIdle{1000}, kFrame{50};

double now_s() { return std::chrono::duration<double>(JogControl::Clock::now().time_since_epoch()).count(); }
}  // namespace

void SimLoop::jog(const JogCommand& command) {
  jog_.command(command);
  queue_.poke();
}

void SimLoop::end_jog(Room& room) {
  jog_.release();
  jog_.report(JogState::still, "");
  room.jogger.reset();
}

std::chrono::milliseconds SimLoop::jog_on(Room& room) {
  using Clock = JogControl::Clock;
  const JogCommand wanted = jog_.wanted();
  if (!room.world || (!wanted.moves() && !room.jogger)) return kIdle;
  const auto now = Clock::now();
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(room.next_jog - now);
  if (left.count() > 0) return left;
  // Real time; after a late frame the next ones come no faster than that.
  room.next_jog = std::max(room.next_jog + kFrame, now + kFrame / 2);
  if (!room.jogger) {
    room.jogger.emplace(*room.world);
    room.session.begin_stroke(now_s());
  }
  try {
    const JogStep step = room.jogger->step(wanted);
    const bool over = !wanted.moves() && room.jogger->at_rest();
    // Why it stopped stays to be read after the key was let go.
    if (wanted.moves() || step.state != JogState::still) jog_.report(step.state, step.message);
    if (step.frame) {
      room.session.keep_by_hand(*step.frame, now_s());
      publish(room);
    }
    if (!over) return kFrame / 2;
    room.jogger.reset();
    room.session.drop_empty_stroke();
    if (jog_.report().state == JogState::moving) jog_.report(JogState::still, "");
  } catch (const SimulationFailed& error) {
    end_jog(room);
    jog_.report(JogState::blocked, std::string(error.what()) + "; the scene was set up anew");
    room.session.restart(*room.world);
  }
  publish(room);
  return kIdle;
}

std::future<MotionResult> SimLoop::jog_gripper(double openness) {
  return queue_.post([this, openness](Room& room) {
    World& w = world(room);
    end_jog(room);
    room.session.begin_stroke(now_s());
    const MotionResult result = move_gripper(w, openness, [&](const Frame& frame) {
      room.session.keep_by_hand(frame, now_s());
      return true;
    });
    publish(room);
    return result;
  });
}

std::future<bool> SimLoop::undo_jog() {
  return queue_.post([this](Room& room) {
    end_jog(room);
    const bool undone = room.session.undo(world(room));
    publish(room);
    return undone;
  });
}

std::future<std::vector<Step>> SimLoop::mark() {
  return queue_.post([this](Room& room) {
    const World& w = world(room);
    if (room.session.mark()) room.history.push_back(w.robot());
    publish(room);
    Step step;
    step.what = step_at_tool(w);
    Step fingers;
    fingers.what = GripperStep{w.robot().openness};
    return std::vector{step, fingers};
  });
}

std::future<Demo> SimLoop::session_demo(Observe observe) {
  return queue_.post(
      [this, observe = std::move(observe)](Room& room) { return room.session.demo(world(room), observe); });
}

}  // namespace flowscope
