// Long work that a user started: its state, its progress, and a way to cancel it.
#pragma once

#include <array>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "web/backend.h"

namespace flowscope {

/// Work of one lane never waits for that of another: an arm that is to move must not wait for a film.
enum class JobLane { motion, exports };

/// The newest jobs of this session. Any thread.
class JobBoard {
 public:
  /// How many jobs of a lane run at once, and how many may wait for that.
  struct Limits {
    int workers = 1;
    std::size_t waiting = 0;
  };
  static constexpr Limits motion{1, 4}, exports{2, 16};
  /// Ended jobs that are still known; older ones are forgotten.
  static constexpr std::size_t ended_kept = 100;

  /// Told of every change, one after the other, from whichever thread made it; it must not call the board.
  explicit JobBoard(std::function<void(const web::JobStatus&)> on_change);
  ~JobBoard();

  /// Registers a job; `work` runs on one of its lane's threads when its turn comes. `work` fills the status
  /// through `update`; what it throws makes the job failed (web::ApiError keeps its code and place), or
  /// cancelled if it was asked to stop. Throws web::ApiError: 429 when as many wait as may, 503 after
  /// shut_down().
  class Handle;
  std::string start(JobLane lane, const std::string& kind, std::function<void(Handle&)> work);

  std::vector<web::JobStatus> all() const;
  web::JobStatus get(const std::string& id) const;  ///< throws web::ApiError 404
  /// Whether it waits or runs; false for one that is not known.
  bool goes_on(const std::string& id) const;
  /// Asks a running job to stop. One that waits, and a running export, whose file will then not appear, count
  /// as cancelled at once. Throws web::ApiError 404.
  void cancel(const std::string& id);
  /// The same for a job that may be forgotten already.
  void cancel_if_known(const std::string& id);
  /// No more jobs; all are asked to stop, those that wait are cancelled. Waits for nobody.
  void close();
  /// The same, and waits for those that run.
  void shut_down();

 private:
  struct Job {
    web::JobStatus status;
    std::function<void(Handle&)> work;
    std::stop_source stop;
    JobLane lane;
  };
  using JobPtr = std::shared_ptr<Job>;
  struct Lane {
    Limits limits;
    const char* what;
    std::deque<JobPtr> waiting = {};
    int running = 0;
    std::condition_variable ready = {};
    std::vector<std::thread> threads = {};
  };

  void serve(Lane& lane);
  void run(Job& job);
  /// False when it was over already: then nothing changes. `telling_` is held, so that what became of a job
  /// is told in the order in which it happened.
  bool change(Job& job, const std::function<void(web::JobStatus&)>& change);
  JobPtr find(const std::string& id) const;  ///< throws web::ApiError 404
  void forget_old();

  std::function<void(const web::JobStatus&)> on_change_;
  std::mutex telling_;  ///< taken before `mutex_`
  mutable std::mutex mutex_;
  std::vector<JobPtr> jobs_;  ///< newest last
  std::array<Lane, 2> lanes_{Lane{motion, "scripts and moves"}, Lane{exports, "exports"}};
  int next_ = 1;
  bool closed_ = false;
};

/// What the work of a job sees of it.
class JobBoard::Handle {
 public:
  /// Changes the status and tells the listeners. False when the job counts as cancelled already: then nothing
  /// changes, and what the work has made must go.
  bool update(const std::function<void(web::JobStatus&)>& change);
  std::stop_token stop() const { return job_.stop.get_token(); }

 private:
  friend class JobBoard;
  Handle(JobBoard& board, Job& job) : board_(board), job_(job) {}
  JobBoard& board_;
  Job& job_;
};

}  // namespace flowscope
