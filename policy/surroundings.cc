#include "policy/surroundings.h"

#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>

#include "policy/point_grid.h"

namespace flowscope {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float reach_m = 0.045f, color_reach = 0.3f;
constexpr int rounds = 3;

Vector2f turned(const Vector2f& moment, float angle_rad) {
  const std::complex<float> z = std::complex<float>(moment.x(), moment.y()) * std::polar(1.f, angle_rad);
  return {z.real(), z.imag()};
}

/// Numbers below a limit, put in as they come and taken out in order: sums of floats depend on it.
class OrderedSet {
 public:
  explicit OrderedSet(std::size_t limit) : word_((limit + 63) / 64), summary_((word_.size() + 63) / 64) {}

  void insert(int number) {
    const auto i = static_cast<std::size_t>(number);
    word_[i / 64] |= std::uint64_t{1} << i % 64;
    summary_[i / 4096] |= std::uint64_t{1} << i / 64 % 64;
  }
  void move_to(std::vector<std::size_t>& numbers) {
    for (std::size_t s = 0; s < summary_.size(); ++s) {
      for (std::uint64_t& words = summary_[s]; words != 0; words &= words - 1) {
        const std::size_t w = 64 * s + static_cast<std::size_t>(std::countr_zero(words));
        for (std::uint64_t& bits = word_[w]; bits != 0; bits &= bits - 1)
          numbers.push_back(64 * w + static_cast<std::size_t>(std::countr_zero(bits)));
      }
    }
  }

 private:
  std::vector<std::uint64_t> word_, summary_;
};

}  // namespace

std::vector<Surroundings> find_surroundings(const std::vector<Vector3f>& position,
                                            const std::vector<Vector3f>& color,
                                            const std::vector<char>& skip) {
  std::vector<Vector3f> place, tint;
  for (std::size_t i = 0; i < position.size() && place.size() < surroundings_sample; ++i) {
    if (skip[i]) continue;
    place.push_back(position[i]);
    tint.push_back(color[i]);
  }
  const PointGrid grid(place, reach_m / 2);
  std::vector<Vector3f> slot_tint;
  for (const int j : grid.index()) slot_tint.push_back(tint[static_cast<std::size_t>(j)]);
  OrderedSet found(place.size());
  std::vector<Surroundings> result(position.size());
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < position.size(); ++i) {
    Surroundings& out = result[i];
    out.middle = position[i];
    if (skip[i]) continue;
    for (int round = 0; round < rounds; ++round) {
      grid.near(out.middle, reach_m, [&](int first, int last) {
        for (auto slot = static_cast<std::size_t>(first); slot < static_cast<std::size_t>(last); ++slot) {
          if ((grid.position()[slot] - out.middle).squaredNorm() > reach_m * reach_m) continue;
          if ((slot_tint[slot] - color[i]).squaredNorm() > color_reach * color_reach) continue;
          found.insert(grid.index()[slot]);
        }
      });
      near.clear();
      found.move_to(near);
      Vector3f sum = Vector3f::Zero();
      for (const std::size_t j : near) sum += place[j];
      if (near.empty()) break;
      out.middle = sum / static_cast<float>(near.size());
    }
    float total = 1e-9f;
    for (const std::size_t j : near) {
      const Vector3f d = place[j] - out.middle;
      const std::complex<float> z(d.x(), d.y()), z2 = z * z;
      const float r2 = std::norm(z) + 1e-9f;
      const std::complex<float> z4 = z2 * z2 / r2;
      out.square += Vector2f(z4.real(), z4.imag());
      out.bar += Vector2f(z2.real(), z2.imag());
      total += r2;
    }
    out.square /= total;
    out.bar /= total;
    out.neighbours = static_cast<int>(near.size());
  }
  return result;
}

Surroundings moved(const Surroundings& around, float yaw_rad, const Vector3f& shift) {
  Surroundings out = around;
  const float c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  const Vector3f m = around.middle;
  out.middle = Vector3f(c * m.x() - s * m.y(), s * m.x() + c * m.y(), m.z()) + shift;
  out.square = turned(around.square, 4 * yaw_rad);
  out.bar = turned(around.bar, 2 * yaw_rad);
  return out;
}

}  // namespace flowscope
