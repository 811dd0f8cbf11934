// Every task folder in assets/tasks: what holds for all of them, whatever they are about.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "recorder/record.h"

namespace flowscope {
namespace {

const TaskLibrary& library() {
  static const TaskLibrary tasks(FLOWSCOPE_SOURCE_DIR "/assets");
  return tasks;
}

/// A run of the task's own demonstration and whether the task counted as done after each of its frames.
struct Watched {
  RunReport report;
  std::vector<bool> done;
};

Watched watch(World& world) {
  Watched run;
  const auto picture = [](const SceneState&) { return Observation{}; };
  run.report = run_script(world, world.episode().demonstration, picture,
                          [&](const Frame&) { run.done.push_back(world.success()); });
  return run;
}

class AnyTask : public testing::TestWithParam<std::string> {};

TEST_P(AnyTask, IsDoneAtTheEndOfItsDemonstrationAndNotBeforeItsLastKeyframe) {
  const auto task = library().get(GetParam());
  World world(task);
  int succeeded = 0;
  for (std::uint64_t seed = 40; seed < 43 && succeeded < 2; ++seed) {
    const int variation = static_cast<int>(seed * 7) % task->variations();
    world.reset(variation, seed);
    EXPECT_FALSE(world.success()) << "at the start of variation " << variation << ", seed " << seed;
    const Watched run = watch(world);
    if (!run.report.success) continue;  // some placements are out of reach
    ++succeeded;
    const Demo& demo = *run.report.demo;
    EXPECT_TRUE(world.success());
    EXPECT_EQ(demo.keyframes.back().frame, demo.info.frames - 1);
    ASSERT_EQ(static_cast<int>(run.done.size()), demo.info.frames);
    ASSERT_GE(demo.keyframes.size(), 2u);
    const int cut = demo.keyframes[demo.keyframes.size() - 2].frame;
    EXPECT_FALSE(run.done[static_cast<std::size_t>(cut)])
        << "done with the last keyframe still to come, variation " << variation << ", seed " << seed;
    for (const Keyframe& keyframe : demo.keyframes)
      EXPECT_TRUE(demo.bounds.contains(keyframe.action.world_from_tool.position))
          << keyframe.action.world_from_tool.position.transpose();
  }
  EXPECT_EQ(succeeded, 2) << "of three placements";
}

TEST_P(AnyTask, HasAnInstructionOfItsOwnForEveryVariation) {
  const auto task = library().get(GetParam());
  std::set<std::string> first;
  for (int v = 0; v < task->variations(); ++v) {
    const auto phrasings = task->instructions(v);
    EXPECT_GE(phrasings.size(), 2u) << "variation " << v;
    first.insert(phrasings.front());
    for (const std::string& text : phrasings) EXPECT_EQ(text.find_first_of("{}"), std::string::npos) << text;
  }
  EXPECT_EQ(static_cast<int>(first.size()), task->variations());
}

std::vector<std::string> names() { return library().names(); }
INSTANTIATE_TEST_SUITE_P(Assets, AnyTask, testing::ValuesIn(names()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace flowscope
