// Training in the background: limits, going on, and what another program start finds.
#include "app/policy_loop.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "app/scene_input.h"
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

  static int refused(std::future<std::vector<FlowTrace>>& answer) {
    try {
      answer.get();
    } catch (const web::ApiError& error) {
      return error.status;
    }
    return 200;
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

TEST_F(PolicyLoopTest, ShortPredictionsPassLongOnesWhichCanBeStopped) {
  std::filesystem::create_directories(file_.parent_path());
  PolicyLoop loop(*store_, file_, [](const web::TrainReport&) {});
  train(loop, request(2, false));
  const PolicyInput input = input_of(store_->load(store_->list().front().id), 0);
  PredictOptions many, few;
  many.flow_steps = 1000;
  few.flow_steps = 4;
  const auto alone = load_policy(file_)->predict_samples(input, few, 2);
  std::stop_source stop;
  auto first = loop.predict(input, many, 64, stop.get_token()), second = loop.predict(input, many, 64);
  const auto passed = loop.predict(input, few, 2).get();
  for (auto* running : {&first, &second})
    EXPECT_EQ(running->wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  ASSERT_EQ(passed.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(passed[i].steps.back().x, alone[i].steps.back().x) << "company changes no bit";
    EXPECT_EQ(passed[i].weights_sha256, alone[i].weights_sha256);
  }
  loop.stop().get();  // training can be started and ended beside them
  stop.request_stop();
  EXPECT_EQ(refused(first), 409);
  loop.leave();
  EXPECT_EQ(refused(second), 503);
  try {
    auto late = loop.predict(input, few);
    EXPECT_EQ(refused(late), 503);
  } catch (const web::ApiError& error) {
    EXPECT_EQ(error.status, 503);
  }
}

TEST_F(PolicyLoopTest, LeavingKeepsWhatWasTrained) {
  std::filesystem::create_directories(file_.parent_path());
  {
    PolicyLoop loop(*store_, file_, [](const web::TrainReport&) {});
    loop.start(request(1'000'000, false)).get();
    while (loop.report().status.step < 3) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    loop.leave();
  }
  EXPECT_GE(load_policy(file_)->generation(), 3u);
}

}  // namespace
}  // namespace flowscope
