// Long work that a user started: its state, its progress, and a way to cancel it.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "web/backend.h"

namespace flowscope {

/// Every job of this session, newest last. Any thread.
class JobBoard {
 public:
  /// Told of every change, from whichever thread made it.
  explicit JobBoard(std::function<void(const web::JobStatus&)> on_change);
  ~JobBoard();

  /// Registers a job and runs `work` on a thread of its own. `work` fills the status through `update`; what
  /// it throws makes the job failed (web::ApiError keeps its code and place).
  class Handle;
  std::string start(const std::string& kind, std::function<void(Handle&)> work);

  std::vector<web::JobStatus> all() const;
  web::JobStatus get(const std::string& id) const;  ///< throws web::ApiError 404
  void cancel(const std::string& id);               ///< throws web::ApiError 404
  /// Asks all to stop and joins them.
  void shut_down();

  class Handle {
   public:
    /// Changes the status and tells the listeners.
    void update(const std::function<void(web::JobStatus&)>& change);
    std::stop_token stop() const { return stop_; }
    const std::string& id() const { return id_; }

   private:
    friend class JobBoard;
    Handle(JobBoard& board, std::string id, std::stop_token stop)
        : board_(board), id_(std::move(id)), stop_(stop) {}
    JobBoard& board_;
    std::string id_;
    std::stop_token stop_;
  };

 private:
  struct Job {
    web::JobStatus status;
    std::jthread thread;
  };
  void change(const std::string& id, const std::function<void(web::JobStatus&)>& change);
  Job& find(const std::string& id);

  std::function<void(const web::JobStatus&)> on_change_;
  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<Job>> jobs_;
  int next_ = 1;
  bool closed_ = false;
};

}  // namespace flowscope
