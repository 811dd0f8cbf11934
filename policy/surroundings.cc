#include "policy/surroundings.h"

#include <cmath>
#include <complex>

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

}  // namespace

std::vector<Surroundings> find_surroundings(const std::vector<Vector3f>& position,
                                            const std::vector<Vector3f>& color,
                                            const std::vector<char>& skip) {
  std::vector<Vector3f> place, tint;
  for (std::size_t i = 0; i < position.size(); ++i) {
    if (skip[i]) continue;
    place.push_back(position[i]);
    tint.push_back(color[i]);
  }
  std::vector<Surroundings> result(position.size());
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < position.size(); ++i) {
    Surroundings& out = result[i];
    out.middle = position[i];
    if (skip[i]) continue;
    for (int round = 0; round < rounds; ++round) {
      near.clear();
      Vector3f sum = Vector3f::Zero();
      for (std::size_t j = 0; j < place.size(); ++j) {
        if ((place[j] - out.middle).squaredNorm() > reach_m * reach_m) continue;
        if ((tint[j] - color[i]).squaredNorm() > color_reach * color_reach) continue;
        near.push_back(j);
        sum += place[j];
      }
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
