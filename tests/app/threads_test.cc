// The two primitives between threads, and the job board.
#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "app/job_board.h"
#include "app/job_queue.h"
#include "app/latest.h"

namespace flowscope {
namespace {

TEST(Latest, WaiterGetsTheNewestAndSkipsWhatItMissed) {
  Latest<int> latest;
  std::uint64_t seen = 0;
  latest.publish(1);
  latest.publish(2);
  EXPECT_EQ(*latest.wait_newer(seen), 2);
  auto waiting = std::async(std::launch::async, [&] { return *latest.wait_newer(seen); });
  latest.publish(3);
  EXPECT_EQ(waiting.get(), 3);
}

TEST(Latest, CloseWakesWaiters) {
  Latest<int> latest;
  std::uint64_t seen = 0;
  auto waiting = std::async(std::launch::async, [&] { return latest.wait_newer(seen); });
  latest.close();
  EXPECT_EQ(waiting.get(), nullptr);
}

struct Room {
  std::thread::id owner;
  int value = 0;
};

TEST(JobQueue, RunsJobsInOrderOnTheOwnersThread) {
  JobQueue<Room> queue;
  std::jthread owner([&] {
    Room room{std::this_thread::get_id()};
    while (queue.run_next(room, std::chrono::milliseconds(50))) {
    }
  });
  auto first = queue.post([](Room& room) { return room.value++; });
  auto second = queue.post([](Room& room) {
    EXPECT_EQ(std::this_thread::get_id(), room.owner);
    return room.value++;
  });
  EXPECT_EQ(first.get(), 0);
  EXPECT_EQ(second.get(), 1);
  queue.close();
}

TEST(JobQueue, ExceptionsTravelThroughTheFutureAndTheOwnerLivesOn) {
  JobQueue<Room> queue;
  std::jthread owner([&] {
    Room room;
    while (queue.run_next(room, std::chrono::milliseconds(50))) {
    }
  });
  auto bad = queue.post([](Room&) -> int { throw std::runtime_error("no"); });
  auto good = queue.post([](Room&) { return 7; });
  EXPECT_THROW(bad.get(), std::runtime_error);
  EXPECT_EQ(good.get(), 7);
  queue.close();
  owner.join();
  EXPECT_THROW(queue.post([](Room&) {}), std::runtime_error);
}

web::JobStatus wait_for_end(const JobBoard& board, const std::string& id) {
  for (;;) {
    const auto status = board.get(id);
    if (status.state != "queued" && status.state != "running") return status;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

TEST(JobBoard, DoneFailedAndCancelledAreDifferentEnds) {
  std::atomic<int> changes{0};
  JobBoard board([&](const web::JobStatus&) { ++changes; });
  const auto done =
      board.start("a", [](JobBoard::Handle& h) { h.update([](auto& s) { s.progress = 0.5; }); });
  const auto failed =
      board.start("b", [](JobBoard::Handle&) { throw web::ApiError(422, "nope", "because", "line 3"); });
  const auto endless = board.start("c", [](JobBoard::Handle& h) {
    while (!h.stop().stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  EXPECT_EQ(wait_for_end(board, done).state, "done");
  EXPECT_EQ(wait_for_end(board, done).progress, 1);
  const auto failure = wait_for_end(board, failed);
  EXPECT_EQ(failure.state, "failed");
  EXPECT_EQ(failure.error_code, "nope");
  EXPECT_EQ(failure.where, "line 3");
  board.cancel(endless);
  EXPECT_EQ(wait_for_end(board, endless).state, "cancelled");
  EXPECT_GE(changes.load(), 6);
  EXPECT_THROW(board.get("job-99"), web::ApiError);
}

}  // namespace
}  // namespace flowscope
