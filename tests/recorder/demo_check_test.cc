#include "recorder/demo_check.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "recorder/demo_file.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::sample_demo;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(DemoCheck, TheSampleIsInOrder) { EXPECT_EQ(find_incoherence(sample_demo()), ""); }

TEST(DemoCheck, AJumpOfOneJointIsNamedByFrameAndJoint) {
  Demo demo = sample_demo();
  for (std::size_t i = 12; i < demo.frames.size(); ++i) demo.frames[i].q[3] += 0.06;
  const std::string problem = find_incoherence(demo);
  EXPECT_TRUE(contains(problem, "frame 12, joint 3: jumps by 0.0")) << problem;
}

TEST(DemoCheck, AFrameThatIsMissingIsAJump) {
  Demo demo = sample_demo();
  for (Frame& frame : demo.frames) {  // five times as fast: 1 rad/s
    for (double& q : frame.q) q *= 5;
    for (double& dq : frame.dq) dq *= 5;
  }
  EXPECT_EQ(find_incoherence(demo), "");
  for (std::size_t i = 5; i < demo.frames.size(); ++i) demo.frames[i].q = sample_demo().frames[i].q;
  for (std::size_t i = 5; i + 1 < demo.frames.size(); ++i) {
    for (std::size_t j = 0; j < demo.frames[i].q.size(); ++j) {
      demo.frames[i].q[j] = 5 * sample_demo().frames[i + 1].q[j];
    }
  }
  EXPECT_TRUE(contains(find_incoherence(demo), "frame 5, joint")) << find_incoherence(demo);
}

TEST(DemoCheck, SpeedsThatWereNeverMeasuredAreFoundInSlowMotionToo) {
  Demo demo = sample_demo();
  for (int i = 20; i < 60; ++i) demo.frames.push_back(testing::sample_frame(i));
  demo.keyframes.back().frame = 59;
  EXPECT_EQ(find_incoherence(demo), "");
  for (Frame& frame : demo.frames) {
    for (double& dq : frame.dq) dq = -dq;  // 0.2 rad/s the wrong way: 0.02 rad in a frame
  }
  EXPECT_TRUE(contains(find_incoherence(demo), "positions and speeds disagree")) << find_incoherence(demo);
}

TEST(DemoCheck, AKeyframeFarOutsideTheBoxIsNamedWithItsDistance) {
  Demo demo = sample_demo();
  demo.keyframes[1].action.world_from_tool.position.z() = 1.72;
  EXPECT_EQ(find_incoherence(demo), "keyframe 1: the tool is 120 mm outside the task's box");
  demo.keyframes[1].action.world_from_tool.position.z() = 1.63;
  EXPECT_EQ(find_incoherence(demo), "");
}

TEST(DemoCheck, AStateThatIsNotFiniteIsNamed) {
  Demo demo = sample_demo();
  demo.frames[4].state.qvel[1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(find_incoherence(demo), "frame 4: a number of the state is not finite");
}

TEST(DemoCheck, TheSecondWithTheSameStatesNamesTheFirst) {
  const testing::TemporaryFolder folder;
  const DemoStore store(folder.path());
  const std::string first = store.save(sample_demo());
  Demo twin = sample_demo();
  twin.info.instruction = "the same motion under another name";
  twin.instructions = {twin.info.instruction};
  const std::string second = "twin";  // past the store, which would not take it
  const Bytes bytes = encode_demo(twin);
  std::ofstream(store.path(second), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  Demo other = sample_demo();
  other.frames[5].state.qpos[2] += 1e-12;
  store.save(other);
  const auto problems = store.check();
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].id, second);
  EXPECT_TRUE(contains(problems[0].problem, "holds the same states as " + first)) << problems[0].problem;
}

}  // namespace
}  // namespace flowscope
