#include "policy/part_crew.h"

#include <ATen/Parallel.h>

namespace flowscope {

PartCrew::~PartCrew() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  called_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void PartCrew::run(int helpers, const std::function<void()>& work) {
  {
    const std::lock_guard lock(mutex_);
    while (static_cast<int>(threads_.size()) < helpers) {
      const int index = static_cast<int>(threads_.size());
      threads_.emplace_back([this, index, seen = call_] { serve(index, seen); });
    }
    work_ = &work;
    wanted_ = busy_ = helpers;
    ++call_;
  }
  called_.notify_all();
  work();
  std::unique_lock lock(mutex_);
  done_.wait(lock, [&] { return busy_ == 0; });
}

void PartCrew::serve(int index, std::uint64_t seen) {
  at::set_num_threads(1);  // of this thread
  std::unique_lock lock(mutex_);
  for (;;) {
    called_.wait(lock, [&] { return ending_ || call_ != seen; });
    if (ending_) return;
    seen = call_;
    if (index >= wanted_) continue;
    const auto& work = *work_;
    lock.unlock();
    work();
    lock.lock();
    if (--busy_ == 0) done_.notify_one();
  }
}

}  // namespace flowscope
