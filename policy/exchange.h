// How the processes of one training run add up their gradients. The transport lives elsewhere (MPI in app).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace flowscope {

/// Data-parallel training: `size` processes with the same weights, each with its own part of a batch. Every
/// call is collective: all ranks make it, in the same order. What comes back is the same on every rank, bit
/// for bit; otherwise the ranks' weights would drift apart. Throws std::runtime_error when the others cannot
/// be reached. One thread at a time.
class GradientExchange {
 public:
  virtual ~GradientExchange() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  /// Each number becomes the sum of it over all ranks.
  virtual void sum(float* numbers, std::size_t count) = 0;
  /// What rank 0 has becomes what every rank has.
  virtual void broadcast(void* bytes, std::size_t count) = 0;
};

/// A run of one process.
class SingleProcess : public GradientExchange {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }
  void sum(float*, std::size_t) override {}
  void broadcast(void*, std::size_t) override {}
};

/// Whether all ranks have the same text. Collective; all ranks hear the same answer.
bool same_everywhere(GradientExchange& exchange, const std::string& text);

}  // namespace flowscope
