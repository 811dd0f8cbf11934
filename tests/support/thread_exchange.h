// Ranks of a training run as threads of one test.
#pragma once

#include <barrier>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "policy/exchange.h"

namespace flowscope::testing {

/// What the ranks share.
class ThreadRoom {
 public:
  explicit ThreadRoom(int size) : all(size), numbers(static_cast<std::size_t>(size)) {}
  std::barrier<> all;
  std::vector<std::vector<float>> numbers;  ///< of each rank
  std::vector<char> bytes;                  ///< of rank 0
};

class ThreadExchange : public GradientExchange {
 public:
  ThreadExchange(ThreadRoom& room, int rank) : room_(room), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(room_.numbers.size()); }
  void sum(float* numbers, std::size_t count) override {
    room_.numbers[static_cast<std::size_t>(rank_)].assign(numbers, numbers + count);
    room_.all.arrive_and_wait();
    for (std::size_t i = 0; i < count; ++i) {
      numbers[i] = 0;
      for (const auto& of_rank : room_.numbers) numbers[i] += of_rank[i];
    }
    room_.all.arrive_and_wait();
  }
  void broadcast(void* bytes, std::size_t count) override {
    const auto* from = static_cast<const char*>(bytes);
    if (rank_ == 0) room_.bytes.assign(from, from + count);
    room_.all.arrive_and_wait();
    std::memcpy(bytes, room_.bytes.data(), count);
    room_.all.arrive_and_wait();
  }

 private:
  ThreadRoom& room_;
  int rank_;
};

/// Runs one thread per rank to its end; rethrows what one of them threw. A rank that fails while the others
/// exchange would leave them waiting, so what may fail must fail on all.
inline void run_ranks(int size, const std::function<void(std::shared_ptr<GradientExchange>)>& work) {
  ThreadRoom room(size);
  std::vector<std::exception_ptr> failed(static_cast<std::size_t>(size));
  {
    std::vector<std::jthread> threads;
    for (int rank = 0; rank < size; ++rank)
      threads.emplace_back([&, rank] {
        try {
          work(std::make_shared<ThreadExchange>(room, rank));
        } catch (...) {
          failed[static_cast<std::size_t>(rank)] = std::current_exception();
        }
      });
  }
  for (const std::exception_ptr& e : failed)
    if (e) std::rethrow_exception(e);
}

}  // namespace flowscope::testing
