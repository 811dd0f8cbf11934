// Every task folder in assets/tasks: what holds for all of them, whatever they are about.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "app/task_check.h"

namespace flowscope {
namespace {

const TaskLibrary& library() {
  static const TaskLibrary tasks(FLOWSCOPE_SOURCE_DIR "/assets");
  return tasks;
}

class AnyTask : public testing::TestWithParam<std::string> {};

TEST_P(AnyTask, IsDoneAtTheEndOfItsDemonstrationAndNotBeforeItsLastKeyframe) {
  const TaskCheck check = check_task(library().get(GetParam()), 3, 40);
  EXPECT_GE(check.successes, 2) << "of three placements; the last failure: "
                                << (check.failures.empty() ? "" : check.failures.back().reason);
  EXPECT_EQ(check.done_at_start, 0);
  EXPECT_EQ(check.done_early, 0);
  EXPECT_TRUE(check.outside.empty()) << check.outside.front().reason;
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
