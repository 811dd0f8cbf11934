// The real recorder, killed at random moments of its life: what it called saved is there and whole, what it
// did not finish is absent, and the next one starts as if nothing had been.
// FLOWSCOPE_KILLS=200 makes it the long run whose figures are in DEVELOPING.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <regex>
#include <set>
#include <thread>

#include "recorder/demo_store.h"
#include "tests/support/child_program.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

int kills_wanted() {
  const char* given = std::getenv("FLOWSCOPE_KILLS");
  return given ? std::max(1, std::atoi(given)) : 5;
}

std::set<std::string> saved_ids(const std::string& text) {
  static const std::regex line("saved ([A-Za-z0-9_-]+), [0-9]+ frames");
  std::set<std::string> ids;
  for (std::sregex_iterator it(text.begin(), text.end(), line), end; it != end; ++it) ids.insert((*it)[1]);
  return ids;
}

int temporaries_in(const std::filesystem::path& folder) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    count += entry.path().extension() != ".demo";
  }
  return count;
}

TEST(KilledRecord, NothingThatWasSavedIsLostAndNothingUnreadableStays) {
  const testing::TemporaryFolder folder;
  const std::string data = (folder.path() / "data").string();
  const DemoStore store(data);
  const int kills = kills_wanted();
  std::mt19937_64 random(std::random_device{}());
  std::set<std::string> announced;
  int left_over = 0;
  using Clock = std::chrono::steady_clock;
  std::chrono::duration<double> until_saved(1);
  for (int kill = 0; kill < kills; ++kill) {
    testing::ChildProgram recorder(
        FLOWSCOPE_PROGRAM, {"record", "push_buttons", "--variation", "0", "--episodes", "1000", "--seed",
                            std::to_string(1000 * kill), "--data", data});
    if (kill == 0) {  // how long a life must be to save something, on this machine
      const auto begin = Clock::now();
      EXPECT_NE(recorder.line_with("saved "), "");
      until_saved = Clock::now() - begin;
    } else {
      std::this_thread::sleep_for(until_saved * std::uniform_real_distribution<double>(0, 2)(random));
    }
    recorder.kill();
    const std::string& text = recorder.rest();
    EXPECT_EQ(text.find("flowscope: "), std::string::npos) << "it complained: " << text;
    for (const std::string& id : saved_ids(text)) announced.insert(id);
    left_over += temporaries_in(std::filesystem::path(data) / "demos") > 0;
  }
  std::set<std::string> there;
  for (const DemoInfo& info : store.list()) there.insert(info.id);
  for (const std::string& id : announced) {
    EXPECT_TRUE(there.contains(id)) << "lost: " << id;
    EXPECT_NO_THROW(store.load(id)) << id;
  }
  int checked = 0;
  for (const DemoProblem& problem : store.check(&checked)) ADD_FAILURE() << problem.problem;
  EXPECT_EQ(checked, static_cast<int>(there.size())) << "a file that no list shows";
  const int unannounced = static_cast<int>(there.size()) - static_cast<int>(announced.size());
  EXPECT_LE(unannounced, kills) << "only the last of each life may have had no time to say so";

  // The next recorder sweeps up and works.
  testing::ChildProgram last(FLOWSCOPE_PROGRAM,
                             {"record", "push_buttons", "--seed", "999999", "--data", data});
  const std::string text = last.rest();
  EXPECT_EQ(last.wait(), 0) << text;
  EXPECT_EQ(temporaries_in(std::filesystem::path(data) / "demos"), 0);
  EXPECT_EQ(store.list().size(), there.size() + 1);
  std::printf(
      "%d kills: %zu announced, %d more had been saved, %d unreadable, %d times a temporary stayed "
      "until the next start\n",
      kills, announced.size(), unannounced, checked - static_cast<int>(there.size()), left_over);
}

}  // namespace
}  // namespace flowscope
