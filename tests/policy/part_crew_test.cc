// Threads that stay: the same ones serve every call, and no call returns before all have done their part.
#include "policy/part_crew.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <thread>

namespace flowscope {
namespace {

TEST(PartCrew, ServesManyCallsWithTheSameFewThreads) {
  PartCrew crew;
  std::mutex mutex;
  std::set<std::thread::id> seen;
  for (int call = 0; call < 300; ++call) {
    const int helpers = call % 4;
    std::atomic<int> began{0}, ended{0};
    crew.run(helpers, [&] {
      ++began;
      {
        const std::lock_guard lock(mutex);
        seen.insert(std::this_thread::get_id());
      }
      ++ended;
    });
    EXPECT_EQ(began, helpers + 1);
    EXPECT_EQ(ended, helpers + 1);
  }
  EXPECT_LE(seen.size(), 4u) << "three helpers and the caller";
}

}  // namespace
}  // namespace flowscope
