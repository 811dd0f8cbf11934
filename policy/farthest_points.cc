#include "policy/farthest_points.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <utility>

namespace flowscope {
namespace {

std::array<float, 6> sample_at(const BucketArrays& b, int slot) {
  std::array<float, 6> sample{};
  for (std::size_t a = 0; a < 3; ++a) {
    sample[a] = b.place[a][slot];
    if (b.tint[a]) sample[3 + a] = b.tint[a][slot];
  }
  return sample;
}

// The slot will not be chosen again: its distance is that of padding.
void take(const BucketArrays& b, const PointKernels& kernels, int slot) {
  b.distance2[slot] = -1;
  kernels.lower(b, sample_at(b, slot).data());
}

}  // namespace

std::vector<int> farthest_points(const FarthestInput& input, int count, int first,
                                 const PointKernels* kernels) {
  const int n = static_cast<int>(input.position.size());
  PointBuckets buckets(input);
  if (first < 0 || first >= n)
    throw std::invalid_argument("farthest points: there is no point " + std::to_string(first) + " of " +
                                std::to_string(n));
  if (!kernels) kernels = supported_point_kernels().front();
  const BucketArrays arrays = buckets.arrays();
  const std::vector<int>& source = buckets.source();
  std::vector<int> chosen;
  int slot = static_cast<int>(std::find(source.begin(), source.end(), first) - source.begin());
  while (static_cast<int>(chosen.size()) < std::min(count, n)) {
    chosen.push_back(source[static_cast<std::size_t>(slot)]);
    take(arrays, *kernels, slot);
    slot = kernels->farthest(arrays, source.data());
  }
  return chosen;
}

std::vector<int> farthest_order(const FarthestInput& input, int even) {
  const int n = static_cast<int>(input.position.size());
  PointBuckets buckets(input);
  const PointKernels& kernels = *supported_point_kernels().front();
  const BucketArrays arrays = buckets.arrays();
  std::vector<int> place = buckets.source();  // of each slot; at the start that of its point
  std::vector<int> slot_at(static_cast<std::size_t>(n));
  for (std::size_t slot = 0; slot < place.size(); ++slot)
    if (place[slot] >= 0) slot_at[static_cast<std::size_t>(place[slot])] = static_cast<int>(slot);
  for (int front = 0; front < std::min(even, n); ++front) {
    const int slot = front == 0 ? slot_at[0] : kernels.farthest(arrays, place.data());
    const int other = slot_at[static_cast<std::size_t>(front)];
    std::swap(place[static_cast<std::size_t>(slot)], place[static_cast<std::size_t>(other)]);
    slot_at[static_cast<std::size_t>(place[static_cast<std::size_t>(other)])] = other;
    slot_at[static_cast<std::size_t>(front)] = slot;
    take(arrays, kernels, slot);
  }
  for (int& slot : slot_at) slot = buckets.source()[static_cast<std::size_t>(slot)];
  return slot_at;
}

}  // namespace flowscope
