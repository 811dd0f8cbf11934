// Typed work for one thread: the other primitive. What a thread owns is its Room; only jobs that run there
// ever see it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <type_traits>

#include "web/backend.h"

namespace flowscope {

/// Jobs are callables on `Room&`; results and exceptions travel back through futures. post() and poke() from
/// any thread, run_*() from the owner's thread only. post() throws web::ApiError 503 after close().
template <class Room>
class JobQueue {
 public:
  template <class F>
  auto post(F job) -> std::future<std::invoke_result_t<F&, Room&>> {
    using Result = std::invoke_result_t<F&, Room&>;
    auto task = std::make_shared<std::packaged_task<Result(Room&)>>(std::move(job));
    auto future = task->get_future();
    {
      std::lock_guard lock(mutex_);
      if (closed_) throw web::ApiError(503, "shutting_down", "flowscope is shutting down");
      jobs_.push_back([task](Room& room) { (*task)(room); });
    }
    wake_.notify_one();
    return future;
  }
  /// Ends a wait without a job: something else changed.
  void poke() {
    {
      std::lock_guard lock(mutex_);
      poked_ = true;
    }
    wake_.notify_one();
  }
  /// Runs what is waiting; never blocks.
  void run_pending(Room& room) {
    for (;;) {
      std::function<void(Room&)> job;
      {
        std::lock_guard lock(mutex_);
        poked_ = false;
        if (jobs_.empty()) return;
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
      job(room);
    }
  }
  /// Sleeps until a job, a poke, close() or the time-out; then runs what is waiting. False once closed.
  bool run_next(Room& room, std::chrono::milliseconds timeout) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, timeout, [&] { return !jobs_.empty() || poked_ || closed_; });
    }
    run_pending(room);
    std::lock_guard lock(mutex_);
    return !closed_;
  }
  /// No more jobs; those that wait still run, their futures are kept.
  void close() {
    {
      std::lock_guard lock(mutex_);
      closed_ = true;
    }
    wake_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void(Room&)>> jobs_;
  bool poked_ = false, closed_ = false;
};

}  // namespace flowscope
