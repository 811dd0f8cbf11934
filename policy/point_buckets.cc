#include "policy/point_buckets.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "policy/space_curve.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

constexpr std::size_t bucket_points = 64;
constexpr std::uint32_t dull_bit = 1u << (3 * kCurveBits);
constexpr float largest = std::numeric_limits<float>::max();

/// Of 1024 cells along each side of a cube.
struct Grid {
  Vector3f low;
  float cells_per_m;
};

struct Keyed {
  std::uint32_t code;
  int index;
};

Grid grid_around(std::span<const Vector3f> position) {
  Vector3f low = position[0], high = position[0], unsound = Vector3f::Zero();
  for (const Vector3f& p : position) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    unsound += 0.f * p;  // zero unless a number is not finite
  }
  if (unsound != Vector3f::Zero()) throw std::invalid_argument("farthest points: a position is not finite");
  return {low, 1023.f / std::max((high - low).maxCoeff(), 1e-30f)};
}

// Every point lies in the cube: nothing to clamp.
std::uint32_t code_in(const Grid& grid, const Vector3f& p) {
  const Vector3f u = (p - grid.low) * grid.cells_per_m;
  return morton_code({static_cast<std::uint32_t>(u.x()), static_cast<std::uint32_t>(u.y()),
                      static_cast<std::uint32_t>(u.z())});
}

// By code, equal ones in their order: three passes of 11 bits, least significant first.
void sort_by_code(std::vector<Keyed>& keys) {
  constexpr int digit_bits = 11, digits = 3;
  constexpr std::uint32_t values = 1u << digit_bits;
  std::vector<std::uint32_t> place(digits * values);
  for (const Keyed& k : keys)
    for (int d = 0; d < digits; ++d)
      ++place[static_cast<std::size_t>(d) * values + (k.code >> d * digit_bits) % values];
  std::vector<Keyed> other(keys.size());
  for (int d = 0; d < digits; ++d) {
    std::uint32_t* const begin = place.data() + static_cast<std::size_t>(d) * values;
    std::exclusive_scan(begin, begin + values, begin, 0u);
    for (const Keyed& k : keys) other[begin[(k.code >> d * digit_bits) % values]++] = k;
    keys.swap(other);
  }
}

// Ends of the buckets: halved at the highest bit in which the codes differ until small enough.
void split(const std::vector<Keyed>& keys, std::size_t first, std::size_t last,
           std::vector<std::size_t>& ends) {
  if (last - first <= bucket_points) {
    ends.push_back(last);
    return;
  }
  const std::uint32_t low = keys[first].code, high = keys[last - 1].code;
  std::size_t middle = first + bucket_points;  // points in one cell of the curve lie at one place, nearly
  if (low != high) {
    const int bit = std::bit_width(low ^ high) - 1;
    const auto at = std::lower_bound(keys.begin() + static_cast<std::ptrdiff_t>(first),
                                     keys.begin() + static_cast<std::ptrdiff_t>(last), high >> bit << bit,
                                     [](const Keyed& k, std::uint32_t code) { return k.code < code; });
    middle = static_cast<std::size_t>(at - keys.begin());
  }
  split(keys, first, middle, ends);
  split(keys, middle, last, ends);
}

int rounded_up(std::size_t n) { return static_cast<int>((n + kPointLanes - 1) / kPointLanes * kPointLanes); }

}  // namespace

PointBuckets::PointBuckets(const FarthestInput& input) : color_weight_(input.color_weight) {
  const std::size_t n = input.position.size();
  if (n == 0) throw std::invalid_argument("farthest points: there are no points");
  const bool tinted = !input.color.empty();
  if (input.salience.size() != input.color.size() || (tinted && input.color.size() != n))
    throw std::invalid_argument("farthest points: positions, colours and saliences differ in number");
  const Grid grid = grid_around(input.position);
  std::vector<Keyed> keys(n);
  for (std::size_t i = 0; i < n; ++i) {
    // What counts less gets buckets of its own: the least salience of a bucket bounds all its distances.
    const bool dull = tinted && input.salience[i] < 1;
    keys[i] = {code_in(grid, input.position[i]) | (dull ? dull_bit : 0), static_cast<int>(i)};
  }
  sort_by_code(keys);
  std::vector<std::size_t> ends;
  split(keys, 0, n, ends);

  first_.push_back(0);
  std::size_t from = 0;
  for (const std::size_t end : ends) {
    for (; from < end; ++from) source_.push_back(keys[from].index);
    source_.resize(static_cast<std::size_t>(rounded_up(source_.size())), -1);
    first_.push_back(static_cast<int>(source_.size()));
  }
  first_.resize(static_cast<std::size_t>(rounded_up(ends.size())) + 1, first_.back());

  farthest2_.assign(first_.size() - 1, -1.f);
  std::fill_n(farthest2_.begin(), ends.size(), largest);
  distance2_.resize(source_.size());
  for (std::size_t slot = 0; slot < source_.size(); ++slot)
    distance2_[slot] = source_[slot] < 0 ? -1.f : largest;
  place_.fill(input.position, source_, first_);
  if (!tinted) return;
  tint_.fill(input.color, source_, first_);
  salience_.assign(source_.size(), 1.f);
  least_salience_.assign(first_.size() - 1, 1.f);
  for (std::size_t k = 0; k < ends.size(); ++k) {
    for (int slot = first_[k]; slot < first_[k + 1]; ++slot) {
      const int i = source_[static_cast<std::size_t>(slot)];
      if (i < 0) break;
      const float s = salience_[static_cast<std::size_t>(slot)] = input.salience[static_cast<std::size_t>(i)];
      if (slot == first_[k] || s < least_salience_[k]) least_salience_[k] = s;
      if (!(s >= 0 && s <= largest))
        throw std::invalid_argument("farthest points: a salience is negative or not finite");
    }
  }
}

void PointBuckets::Axes::fill(std::span<const Vector3f> points, const std::vector<int>& source,
                              const std::vector<int>& first) {
  for (int a = 0; a < 3; ++a) {
    value[a].resize(source.size());
    low[a].resize(first.size() - 1);
    high[a].resize(first.size() - 1);
  }
  for (std::size_t k = 0; k + 1 < first.size(); ++k) {
    if (first[k] == first[k + 1]) break;  // buckets that fill up the last vector
    Vector3f lowest = Vector3f::Constant(largest), highest = -lowest;
    for (auto slot = static_cast<std::size_t>(first[k]); slot < static_cast<std::size_t>(first[k + 1]);
         ++slot) {
      if (source[slot] < 0) break;
      const Vector3f& p = points[static_cast<std::size_t>(source[slot])];
      for (int a = 0; a < 3; ++a) value[a][slot] = p[a];
      lowest = lowest.cwiseMin(p);
      highest = highest.cwiseMax(p);
    }
    for (int a = 0; a < 3; ++a) {
      low[a][k] = lowest[a];
      high[a][k] = highest[a];
    }
  }
}

BucketArrays PointBuckets::arrays() {
  BucketArrays b;
  b.buckets = static_cast<int>(farthest2_.size());
  b.first = first_.data();
  for (int a = 0; a < 3; ++a) {
    b.place[a] = place_.value[a].data();
    b.place_low[a] = place_.low[a].data();
    b.place_high[a] = place_.high[a].data();
    if (salience_.empty()) continue;
    b.tint[a] = tint_.value[a].data();
    b.tint_low[a] = tint_.low[a].data();
    b.tint_high[a] = tint_.high[a].data();
  }
  if (!salience_.empty()) {
    b.salience = salience_.data();
    b.least_salience = least_salience_.data();
  }
  b.tint_weight = color_weight_;
  b.distance2 = distance2_.data();
  b.farthest2 = farthest2_.data();
  return b;
}

}  // namespace flowscope
