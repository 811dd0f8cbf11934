// The expert's own keyframes, carried out as predictions are, do the task: what fails in eval is the
// policy's.
#include <gtest/gtest.h>

#include "app/sim_loop.h"
#include "recorder/record.h"

namespace flowscope {
namespace {

class Execute : public ::testing::TestWithParam<const char*> {};

TEST_P(Execute, TheExpertsKeyframesDoTheTaskAtTheFirstAttempt) {
  const TaskLibrary tasks(FLOWSCOPE_SOURCE_DIR "/assets");
  World world(tasks.get(GetParam()));
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const int variation = static_cast<int>(seed) % world.task().variations();
    world.reset(variation, seed);
    const RunReport report =
        run_script(world, world.episode().demonstration, [](const SceneState&) { return Observation{}; });
    ASSERT_TRUE(report.demo) << report.reason;
    world.reset(variation, seed);
    for (const Keyframe& keyframe : report.demo->keyframes) {
      EXPECT_FALSE(world.success()) << "seed " << seed;
      execute_keyframe(world, keyframe.action, seed, [&](const Frame&) { return !world.success(); });
    }
    EXPECT_TRUE(world.success()) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(AllTasks, Execute,
                         // Pressing, pulling, fitting; pushing along a line; closing again on a thin wall.
                         ::testing::Values("push_buttons", "open_drawer", "insert_onto_square_peg",
                                           "slide_block_to_color_target", "reach_and_drag",
                                           "sweep_to_dustpan_of_size", "stack_cups"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace flowscope
