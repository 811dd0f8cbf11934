// Threads that stay between optimiser steps: one made and joined for every step costs time, and leaves memory
// behind.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace flowscope {

/// Helpers of one thread at a time. They appear when they are first needed and end with this object.
class PartCrew {
 public:
  PartCrew() = default;
  ~PartCrew();
  PartCrew(const PartCrew&) = delete;
  PartCrew& operator=(const PartCrew&) = delete;

  /// Calls `work` on the calling thread and on `helpers` others, each on one thread of torch's, and returns
  /// when all have returned. `work` must not throw.
  void run(int helpers, const std::function<void()>& work);

 private:
  void serve(int index, std::uint64_t seen);

  std::mutex mutex_;
  std::condition_variable called_, done_;
  const std::function<void()>* work_ = nullptr;
  std::uint64_t call_ = 0;  ///< counts the calls of run()
  int wanted_ = 0, busy_ = 0;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace flowscope
