// Each test pins one clause of the benchmark's keyframe rule on a hand-made sequence.
#include "recorder/keyframes.h"

#include <gtest/gtest.h>

#include <string>

namespace flowscope {
namespace {

using Indices = std::vector<int>;

/// One letter a frame: 'm' moves, 's' stands still; capital letters: gripper closed.
std::vector<Frame> frames_of(const std::string& letters) {
  std::vector<Frame> frames;
  for (const char letter : letters) {
    Frame frame;
    frame.time_s = 0.05 * static_cast<double>(frames.size());
    frame.dq.fill(0.0);
    if (letter == 'm' || letter == 'M') frame.dq[3] = 0.5;
    frame.gripper_open = letter == 'm' || letter == 's';
    frames.push_back(frame);
  }
  return frames;
}

Indices keyframes_of(const std::string& letters) { return find_keyframes(frames_of(letters)); }

TEST(Keyframes, AMotionWithoutStopHasOnlyItsLastFrame) { EXPECT_EQ(keyframes_of("mmmmmmmm"), Indices({7})); }

TEST(Keyframes, AStopIsOne) { EXPECT_EQ(keyframes_of("mmmmsmmmmm"), Indices({4, 9})); }

TEST(Keyframes, FrameZeroNeverIsThoughItStandsStill) {
  EXPECT_EQ(keyframes_of("smmmmmmm"), Indices({7}));
  EXPECT_EQ(keyframes_of("s"), Indices());
  EXPECT_EQ(keyframes_of(""), Indices());
}

TEST(Keyframes, AStopAtFrameZeroDelaysTheNext) { EXPECT_EQ(keyframes_of("sssssssmmmmm"), Indices({5, 11})); }

TEST(Keyframes, AfterAStopFourFramesPass) {
  // Stops at 2, then 3..6 wait, then 7 counts again.
  EXPECT_EQ(keyframes_of("mmssssssmmmmm"), Indices({2, 7, 12}));
  EXPECT_EQ(keyframes_of("mmsssssmmmmm"), Indices({2, 11}));
}

TEST(Keyframes, EveryJointMustStandStill) {
  auto frames = frames_of("mmmmsmmmmm");
  frames[4].dq[6] = -0.2;
  EXPECT_EQ(find_keyframes(frames), Indices({9}));
}

TEST(Keyframes, TheToleranceIsAbsoluteAndInclusive) {
  auto frames = frames_of("mmmmsmmmmm");
  frames[4].dq.fill(-0.1);
  EXPECT_EQ(find_keyframes(frames), Indices({4, 9}));
  frames[4].dq[0] = 0.1001;
  EXPECT_EQ(find_keyframes(frames), Indices({9}));
}

TEST(Keyframes, AGripperChangeIsOneEvenInMotion) {
  EXPECT_EQ(keyframes_of("mmmmMMMMMM"), Indices({4, 9}));
  EXPECT_EQ(keyframes_of("mmmmMMMmmmmm"), Indices({4, 7, 11}));
}

TEST(Keyframes, NoStopWhereTheGripperChangesBeforeOrAfter) {
  // Frame 3 sees the change at i+1, frames 4 and 5 see it at i-1 and i-2; frame 6 is the first that sees
  // none.
  EXPECT_EQ(keyframes_of("mmmsMMMMMMM"), Indices({4, 10}));
  EXPECT_EQ(keyframes_of("mmmmMSMMMMM"), Indices({4, 10}));
  EXPECT_EQ(keyframes_of("mmmmMMSMMMM"), Indices({4, 6, 10}));
}

TEST(Keyframes, NeitherOfTheLastTwoFramesIsAStop) {
  // Frame 8 of 10 (T-2) stands still: not a stop. Frame 7 (T-3) is.
  EXPECT_EQ(keyframes_of("mmmmmmmmsm"), Indices({9}));
  EXPECT_EQ(keyframes_of("mmmmmmmsmm"), Indices({7, 9}));
}

TEST(Keyframes, ANeighbourOfTheLastGoes) {
  // The gripper changes at T-2: the change and the end are neighbours, the change goes.
  EXPECT_EQ(keyframes_of("mmsmmmmmMM"), Indices({2, 9}));
  // Only the last pair is thinned, neighbours before it stay.
  EXPECT_EQ(keyframes_of("mmmMmmmmmm"), Indices({3, 4, 9}));
}

TEST(Keyframes, IndicesBeforeTheStartAreClamped) {
  // Frame 1 looks at frame -1: clamped to 0, not wrapped to the closed end.
  EXPECT_EQ(keyframes_of("msmmmmMMMM"), Indices({1, 6, 9}));
}

TEST(Keyframes, WaitingForASlowGripperIsNoActionToLearn) {
  auto frames = frames_of("MMMMSSSSSSSSsmmmmmm");
  frames.back().world_from_tool.position.x() = 0.1;
  EXPECT_EQ(find_keyframes(frames), Indices({4, 9, 12, 18}));
  EXPECT_EQ(keyframes_to_learn(frames), Indices({4, 12, 18}));
  frames[6].dq[0] = 0.5;  // there and back
  EXPECT_EQ(keyframes_to_learn(frames), find_keyframes(frames));
}

}  // namespace
}  // namespace flowscope
