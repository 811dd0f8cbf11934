// The newest value wins: one of the two primitives that carry values between threads.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>

namespace flowscope {

/// Holds the newest `shared_ptr<const T>`; readers never make a writer wait for more than a pointer swap. Any
/// thread.
template <class T>
class Latest {
 public:
  using Ptr = std::shared_ptr<const T>;

  void publish(Ptr value) {
    {
      std::lock_guard lock(mutex_);
      value_ = std::move(value);
      ++version_;
    }
    changed_.notify_all();
  }
  void publish(T value) { publish(std::make_shared<const T>(std::move(value))); }

  Ptr get() const {
    std::lock_guard lock(mutex_);
    return value_;
  }
  std::uint64_t version() const {
    std::lock_guard lock(mutex_);
    return version_;
  }
  /// Waits for a value newer than `seen` and sets `seen` to it; null once closed.
  Ptr wait_newer(std::uint64_t& seen) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return version_ > seen || closed_; });
    if (closed_) return nullptr;
    seen = version_;
    return value_;
  }
  /// Wakes every waiter for good.
  void close() {
    {
      std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  Ptr value_;
  std::uint64_t version_ = 0;
  bool closed_ = false;
};

}  // namespace flowscope
