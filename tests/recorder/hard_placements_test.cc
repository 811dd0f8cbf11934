// Placements at which demonstrations once failed, each for a reason of its own.
#include <gtest/gtest.h>

#include "recorder/record.h"
#include "recorder/task.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

struct HardPlacement {
  const char* task;
  int variation;
  std::uint64_t seed;
  std::size_t keyframes;
  const char* what_is_hard;
};

void PrintTo(const HardPlacement& hard, std::ostream* out) { *out << hard.task << ", " << hard.what_is_hard; }

class AHardPlacement : public ::testing::TestWithParam<HardPlacement> {};

TEST_P(AHardPlacement, SucceedsWithKeyframesInsideTheBounds) {
  const HardPlacement& hard = GetParam();
  const TaskLibrary library(find_assets());
  World world(library.get(hard.task));
  world.reset(hard.variation, hard.seed);
  const auto no_picture = [](const SceneState&) { return Observation{}; };
  const RunReport report = run_script(world, world.episode().demonstration, no_picture, {});
  ASSERT_TRUE(report.success) << report.reason;
  EXPECT_EQ(report.demo->keyframes.size(), hard.keyframes);
  for (const auto& keyframe : report.demo->keyframes) {
    EXPECT_TRUE(report.demo->bounds.contains(keyframe.action.world_from_tool.position)) << keyframe.frame;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Known, AHardPlacement,
    ::testing::Values(
        HardPlacement{"put_money_in_safe", 0, 30039, 5, "the first path found turns back half-way"},
        HardPlacement{"reach_and_drag", 5, 20025, 6,
                      "few values of the seventh joint lead on along the lines"},
        HardPlacement{"unplug_charger", 0, 30021, 2, "the socket lies near the edge of the arm's reach"},
        HardPlacement{"setup_checkers", 1, 30061, 11, "a piece that fingers sink into is flung away"},
        HardPlacement{"close_jar", 6, 20186, 6,
                      "the line down passes close by a singularity of the shoulder"},
        HardPlacement{"stack_cups", 10, 20290, 11, "the rim's nearest grip lies beyond the arm's reach"},
        HardPlacement{"stack_cups", 2, 50022, 11, "what is carried grazes a cup on the shortest way"},
        HardPlacement{"light_bulb_in", 3, 60623, 7, "the way up is possible from few ends of the way down"},
        HardPlacement{"place_wine_at_rack_location", 2, 5016, 5,
                      "the pull back, in the tool's frame, is possible from few ends of the way in"},
        HardPlacement{"slide_block_to_color_target", 3, 60083, 5,
                      "the fingers still touch the block three centimetres up"}));

}  // namespace
}  // namespace flowscope
