// A few threads for what may block. Tasks run in the order posted, several at a time.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace flowscope::web {

class WorkerPool {
 public:
  explicit WorkerPool(int threads, std::size_t longest_queue = 256);
  ~WorkerPool() { stop(); }
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// False when the queue is full or the pool has stopped. Tasks must not throw.
  bool post(std::function<void()> task);
  /// Finishes what runs, drops what waits, joins. Never call it from a task.
  void stop();
  /// The same, but what waits is done, too.
  void finish();

 private:
  void run();
  void join();
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<std::function<void()>> tasks_;
  std::size_t longest_queue_;
  bool stopped_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace flowscope::web
