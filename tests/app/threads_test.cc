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
  const auto done = board.start(JobLane::exports, "a",
                                [](JobBoard::Handle& h) { h.update([](auto& s) { s.progress = 0.5; }); });
  const auto failed = board.start(JobLane::exports, "b", [](JobBoard::Handle&) {
    throw web::ApiError(422, "nope", "because", "line 3");
  });
  const auto endless = board.start(JobLane::motion, "c", [](JobBoard::Handle& h) {
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

void until_stopped(JobBoard::Handle& handle) {
  while (!handle.stop().stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

int refusal(JobBoard& board, JobLane lane) {
  try {
    board.start(lane, "one more", [](JobBoard::Handle&) {});
  } catch (const web::ApiError& error) {
    return error.status;
  }
  return 0;
}

TEST(JobBoard, FewRunSomeWaitAndTheRestIsRefused) {
  JobBoard board([](const web::JobStatus&) {});
  std::atomic<int> running{0}, most{0};
  std::vector<std::string> ids;
  const std::size_t places = JobBoard::exports.workers + JobBoard::exports.waiting;
  for (std::size_t i = 0; i < places; ++i) {
    ids.push_back(board.start(JobLane::exports, "film", [&](JobBoard::Handle& handle) {
      most = std::max(most.load(), ++running);
      until_stopped(handle);
      --running;
    }));
  }
  EXPECT_EQ(refusal(board, JobLane::exports), 429);
  EXPECT_EQ(refusal(board, JobLane::motion), 0) << "the arm waits for no film";
  // One that waits is cancelled at once, never runs, and leaves its place.
  EXPECT_EQ(board.get(ids.back()).state, "queued");
  board.cancel(ids.back());
  EXPECT_EQ(board.get(ids.back()).state, "cancelled");
  EXPECT_EQ(refusal(board, JobLane::exports), 0);
  for (const std::string& id : ids) board.cancel(id);
  for (const std::string& id : ids) EXPECT_EQ(wait_for_end(board, id).state, "cancelled");
  EXPECT_LE(most, JobBoard::exports.workers);
}

TEST(JobBoard, OldEndedJobsAreForgottenAndWhatGoesOnIsNot) {
  JobBoard board([](const web::JobStatus&) {});
  const std::string first = board.start(JobLane::exports, "quick", [](JobBoard::Handle&) {});
  const std::string endless = board.start(JobLane::motion, "endless", until_stopped);
  for (std::size_t i = 0; i < JobBoard::ended_kept; ++i)
    wait_for_end(board, board.start(JobLane::exports, "quick", [](JobBoard::Handle&) {}));
  // The last one is counted a moment after it says that it is done.
  for (int i = 0; i < 1000 && board.all().size() > JobBoard::ended_kept + 1; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  EXPECT_EQ(board.all().size(), JobBoard::ended_kept + 1);
  EXPECT_THROW(board.get(first), web::ApiError);
  EXPECT_NO_THROW(board.cancel_if_known(first));
  EXPECT_TRUE(board.goes_on(endless));
  EXPECT_FALSE(board.goes_on(first));
}

TEST(JobBoard, WhatWasKeptBeforeTheWishToStopIsDone) {
  JobBoard board([](const web::JobStatus&) {});
  const std::string id = board.start(JobLane::motion, "script", [](JobBoard::Handle& handle) {
    handle.update([](web::JobStatus& s) {
      s.demo = "push_buttons-0001";
      s.success = true;
    });
    until_stopped(handle);
  });
  while (board.get(id).demo.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  board.cancel(id);
  EXPECT_EQ(wait_for_end(board, id).state, "done");
}

TEST(JobBoard, ARunningExportIsCancelledAtOnceAndHearsThatItsFileMustGo) {
  JobBoard board([](const web::JobStatus&) {});
  std::atomic<bool> go_on{false}, ended{false};
  std::atomic<int> wanted{-1};
  const std::string id = board.start(JobLane::exports, "film", [&](JobBoard::Handle& handle) {
    while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // cannot be interrupted here
    wanted = handle.update([](web::JobStatus& s) { s.success = true; });
    ended = true;
  });
  while (board.get(id).state != "running") std::this_thread::sleep_for(std::chrono::milliseconds(1));
  board.cancel(id);
  EXPECT_EQ(board.get(id).state, "cancelled");
  go_on = true;
  while (!ended) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(wanted, 0);
  board.shut_down();
  EXPECT_EQ(board.get(id).state, "cancelled");
}

TEST(JobBoard, ClosingEndsWhatRunsAndWhatWaits) {
  JobBoard board([](const web::JobStatus&) {});
  std::vector<std::string> ids;
  for (int i = 0; i < 6; ++i) ids.push_back(board.start(JobLane::exports, "film", until_stopped));
  board.shut_down();
  for (const std::string& id : ids) EXPECT_EQ(board.get(id).state, "cancelled");
  EXPECT_EQ(refusal(board, JobLane::exports), 503);
}

}  // namespace
}  // namespace flowscope
