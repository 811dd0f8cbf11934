// The expert's own keyframes, carried out as predictions are, do the task: what fails in eval is the
// policy's.
#include <gtest/gtest.h>

#include "app/sim_loop.h"
#include "recorder/record.h"

namespace flowscope {
namespace {

constexpr int kRuns = 6;

struct Expected {
  const char* task;
  int least;  ///< of kRuns
};

class Execute : public ::testing::TestWithParam<Expected> {};

TEST_P(Execute, TheExpertsKeyframesDoTheTaskAtTheFirstAttempt) {
  const TaskLibrary tasks(FLOWSCOPE_SOURCE_DIR "/assets");
  World world(tasks.get(GetParam().task));
  int done = 0, seen = 0;
  for (std::uint64_t seed = 0; seen < kRuns; ++seed) {
    ASSERT_LE(seed, kRuns + 1u) << "the expert fails too often";
    const int variation = static_cast<int>(seed) % world.task().variations();
    world.reset(variation, seed);
    const RunReport report =
        run_script(world, world.episode().demonstration, [](const SceneState&) { return Observation{}; });
    if (!report.demo) continue;
    ++seen;
    world.reset(variation, seed);
    for (const Keyframe& keyframe : report.demo->keyframes) {
      EXPECT_FALSE(world.success()) << "seed " << seed;
      execute_keyframe(world, keyframe.action, seed, [&](const Frame&) { return !world.success(); });
    }
    done += world.success();
  }
  EXPECT_GE(done, GetParam().least);
}

INSTANTIATE_TEST_SUITE_P(AllTasks, Execute,
                         // Pressing, pulling, fitting; pushing along a line, where now and then the way back
                         // pushes too; closing again on a thin wall.
                         ::testing::Values(Expected{"push_buttons", kRuns}, Expected{"open_drawer", kRuns},
                                           Expected{"insert_onto_square_peg", kRuns},
                                           Expected{"slide_block_to_color_target", 5},
                                           Expected{"reach_and_drag", 5},
                                           Expected{"sweep_to_dustpan_of_size", 5},
                                           Expected{"stack_cups", kRuns}),
                         [](const auto& test) { return test.param.task; });

}  // namespace
}  // namespace flowscope
