// Training in the background: limits, going on, and what another program start finds.
#include "app/policy_loop.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

class PolicyLoopTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto recorded =
        testing::run_command({"record", "push_buttons", "--seed", "3", "--data", folder_.path().string()});
    ASSERT_EQ(recorded.code, 0) << recorded.err;
    store_ = std::make_unique<DemoStore>(folder_.path());
  }
  static web::TrainRequest request(int steps, bool resume) {
    web::TrainRequest request;
    request.start = true;
    request.resume = resume;
    request.options.preset = "nano";
    request.steps = steps;
    return request;
  }
  static std::int64_t train(PolicyLoop& loop, const web::TrainRequest& request) {
    loop.start(request).get();
    while (loop.report().running) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(loop.report().error, "");
    return loop.report().status.step;
  }

  const testing::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "policies" / "live.flow";
  std::unique_ptr<DemoStore> store_;
};

TEST_F(PolicyLoopTest, GoesOnAfterTheEndAndAfterAnotherProgramStart) {
  std::filesystem::create_directories(file_.parent_path());
  {
    PolicyLoop loop(*store_, file_, [](const web::TrainReport&) {});
    EXPECT_EQ(train(loop, request(3, false)), 3);
    EXPECT_EQ(train(loop, request(2, true)), 5);
    EXPECT_EQ(loop.report().status.demos, 1) << "known again, and once";
    EXPECT_EQ(loop.report().loss_history.size(), 5u);
  }
  PolicyLoop later(*store_, file_, [](const web::TrainReport&) {});
  EXPECT_THROW(later.start(request(2, true)).get(), web::ApiError) << "nothing is loaded";
  later.load(file_).get();
  EXPECT_EQ(later.status().generation, 5u);
  EXPECT_EQ(train(later, request(2, true)), 7);
  EXPECT_EQ(later.report().status.demos, 1);
  EXPECT_EQ(train(later, request(2, false)), 2) << "without resume it starts afresh";
}

}  // namespace
}  // namespace flowscope
