// Random numbers that are the same on every machine: (task, variation, seed) decides an episode, bit for bit.
#pragma once

#include <cstdint>
#include <random>
#include <string>

namespace flowscope {

/// std::mt19937_64 is fixed by the standard; its distributions are not, so the mapping to numbers is our own.
class TaskRandom {
 public:
  TaskRandom(const std::string& task, std::uint64_t variation, std::uint64_t seed)
      : engine_(mix(mix(mix(hash(task)) ^ variation) ^ seed)) {}

  /// In [lower, upper).
  double uniform(double lower, double upper) {
    constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * kUnit);
  }
  /// In [0, count); count > 0.
  std::size_t index(std::size_t count) {
    const std::uint64_t bound = count;
    const std::uint64_t limit = ~std::uint64_t{0} - ~std::uint64_t{0} % bound;
    std::uint64_t value = engine_();
    while (value >= limit) value = engine_();  // without it small indices would be a little more likely
    return value % bound;
  }

 private:
  static std::uint64_t hash(const std::string& text) {  // FNV-1a
    std::uint64_t value = 14695981039346656037ull;
    for (const unsigned char c : text) value = (value ^ c) * 1099511628211ull;
    return value;
  }
  static std::uint64_t mix(std::uint64_t x) {  // the finaliser of SplitMix64
    x += 0x9E3779B97F4A7C15ull;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
    return x ^ (x >> 31);
  }
  std::mt19937_64 engine_;
};

}  // namespace flowscope
