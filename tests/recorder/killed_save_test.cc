// A program that saves one demonstration after the other is killed within its saves: what it called saved is
// there and whole, and nothing that is there is not. FLOWSCOPE_KILLS=200 makes it the long run.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "recorder/demo_store.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

[[noreturn]] void save_for_ever(const std::filesystem::path& data, int told) {
  const DemoStore store(data);
  const Demo demo = testing::sample_demo();
  for (std::uint64_t seed = 0;; ++seed) {
    Demo next = demo;
    next.frames.front().state.ctrl.front() = static_cast<double>(seed);  // no two the same
    const std::string line = store.save(next) + "\n";
    if (::write(told, line.data(), line.size()) < 0) ::_exit(1);
  }
}

/// The ids that a child told so far, and how long it took for one.
class Told {
 public:
  explicit Told(int file) : file_(file) {}
  ~Told() { ::close(file_); }
  Told(const Told&) = delete;
  Told& operator=(const Told&) = delete;

  /// Waits for so many more; false when the child ended before.
  bool wait_for(int lines) {
    for (char byte = 0; lines > 0; text_ += byte) {
      if (::read(file_, &byte, 1) != 1) return false;
      lines -= byte == '\n';
    }
    return true;
  }
  std::set<std::string> ids() {
    while (wait_for(1)) {
    }
    std::set<std::string> ids;
    std::istringstream stream(text_.substr(0, text_.rfind('\n') + 1));
    for (std::string line; std::getline(stream, line);) ids.insert(line);
    return ids;
  }

 private:
  int file_;
  std::string text_;
};

TEST(KilledSave, KillsLoseNothingAndLeaveNothingUnreadable) {
  const testing::TemporaryFolder folder;
  const char* given = std::getenv("FLOWSCOPE_KILLS");
  const int kills = given ? std::max(1, std::atoi(given)) : 40;
  std::mt19937_64 random(9);
  std::size_t saved = 0, kills_within_a_save = 0;
  std::chrono::duration<double> one_save(0.005);
  for (int kill = 0; kill < kills; ++kill) {
    const auto data = folder.path() / std::to_string(kill);
    int told[2];
    ASSERT_EQ(::pipe2(told, O_CLOEXEC), 0);
    const pid_t child = ::fork();
    if (child == 0) save_for_ever(data, told[1]);
    ::close(told[1]);
    // Up to two saves, then a moment within the next one, however long that takes on this machine.
    using Clock = std::chrono::steady_clock;
    Told lines(told[0]);
    const auto begin = Clock::now();
    const int wait = std::uniform_int_distribution<int>(0, 2)(random);
    lines.wait_for(wait);
    if (wait > 0) one_save = (Clock::now() - begin) / wait;
    std::this_thread::sleep_for(one_save * std::uniform_real_distribution<double>(0, 1)(random));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const std::set<std::string> ids = lines.ids();
    if (!std::filesystem::exists(data)) continue;
    const DemoStore store(data);
    std::set<std::string> there;
    for (const DemoInfo& info : store.list()) there.insert(info.id);
    for (const std::string& id : ids) EXPECT_TRUE(there.contains(id)) << "kill " << kill << " lost " << id;
    for (const std::string& id : there) EXPECT_EQ(store.load(id).frames.size(), 20u);
    for (const DemoProblem& problem : store.check()) ADD_FAILURE() << problem.problem;
    // At most the one that was about to be announced, and at most one temporary.
    EXPECT_LE(there.size(), ids.size() + 1);
    const auto entries = std::distance(std::filesystem::directory_iterator(data / "demos"), {});
    EXPECT_LE(entries, static_cast<std::ptrdiff_t>(there.size()) + 1);
    saved += ids.size();
    kills_within_a_save += static_cast<std::size_t>(entries) > there.size() || there.size() > ids.size();
    std::filesystem::remove_all(data);
  }
  EXPECT_GT(saved, static_cast<std::size_t>(kills) / 2) << "hardly anything was saved: nothing is shown";
  EXPECT_GT(kills_within_a_save, static_cast<std::size_t>(kills) / 10)
      << "hardly any kill hit a save: nothing is shown";
}

}  // namespace
}  // namespace flowscope
