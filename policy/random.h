// Random numbers that are the same in every program start and on every standard library: noise is part of a
// trace.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace flowscope {

/// SplitMix64 (Steele, Lea, Flood 2014): 64 bits of state, so a checkpoint stores it as one number.
class Random {
 public:
  explicit Random(std::uint64_t seed = 0) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// In 0 … n-1, n > 0.
  int below(int n) { return static_cast<int>(uniform() * n); }
  /// Standard normal (Box-Muller; the second value is not kept, so that the state stays one number).
  double normal() {
    const double u = 1.0 - uniform(), v = uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
  }
  std::uint64_t state() const { return state_; }

 private:
  std::uint64_t state_;
};

}  // namespace flowscope
