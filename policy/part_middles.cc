#include "policy/part_middles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

namespace flowscope {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using Complex = std::complex<float>;

constexpr float least_area_m2 = 1e-5f;  // seen from above, a line has no middle

float cross(const Vector2f& a, const Vector2f& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Convex outline, counter-clockwise, by Andrew's monotone chain (10.1016/0020-0190(79)90072-3).
std::vector<Vector2f> outline(std::vector<Vector2f> points) {
  std::ranges::sort(points, [](const Vector2f& a, const Vector2f& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Vector2f> hull;
  const auto chain = [&hull](const auto& sorted) {
    const std::size_t first = hull.size();
    for (const Vector2f& p : sorted) {
      while (hull.size() >= first + 2 &&
             cross(hull.back() - hull[hull.size() - 2], p - hull[hull.size() - 2]) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // the other chain starts with it
  };
  chain(points);
  std::ranges::reverse(points);
  chain(points);
  return hull;
}

struct Area {
  float size_m2 = 0;
  Vector2f middle = Vector2f::Zero();
};

Area area_of(const std::vector<Vector2f>& hull) {
  Area area;
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) {
    const Vector2f a = hull[i] - hull[0], b = hull[i + 1] - hull[0];
    const float size = cross(a, b) / 2;
    area.size_m2 += size;
    area.middle += size * (a + b) / 3;
  }
  if (area.size_m2 > 0) area.middle = hull[0] + area.middle / area.size_m2;
  return area;
}

/// ∫ z^4 / |z|^2, ∫ z^2 and ∫ |z|^2 over the outline's area, z from its middle. All three grow with the
/// square of |z|: over the triangle from the middle to an edge each is a quarter of |a × b| times its mean
/// along the edge.
void read_moments(const std::vector<Vector2f>& hull, const Vector2f& middle, Surroundings& out) {
  constexpr std::array<float, 5> place{0, 0.25f, 0.5f, 0.75f, 1},
      weight{7.f / 90, 32.f / 90, 12.f / 90, 32.f / 90, 7.f / 90};  // Boole's rule
  Complex square = 0, bar = 0;
  float total = 1e-12f;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2f a = hull[i] - middle, b = hull[(i + 1) % hull.size()] - middle;
    for (std::size_t k = 0; k < place.size(); ++k) {
      const Vector2f p = a + place[k] * (b - a);
      const Complex z2 = Complex(p.x(), p.y()) * Complex(p.x(), p.y());
      const float w = weight[k] * cross(a, b), r2 = p.squaredNorm() + 1e-12f;
      square += w * z2 * z2 / r2;
      bar += w * z2;
      total += w * r2;
    }
  }
  square /= total;
  bar /= total;
  out.square = {square.real(), square.imag()};
  out.bar = {bar.real(), bar.imag()};
}

/// Of one part's points; false for a part that is large, or seen as a line.
bool surround(const std::vector<Vector3f>& points, Surroundings& out) {
  std::vector<Vector2f> flat;
  float low = points.front().z(), high = low;
  for (const Vector3f& p : points) {
    flat.push_back(p.head<2>());
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  const std::vector<Vector2f> hull = outline(std::move(flat));
  const Area area = area_of(hull);
  if (area.size_m2 < least_area_m2) return false;
  for (const Vector2f& p : hull)
    if ((p - area.middle).norm() > part_reach_m) return false;
  out.middle = {area.middle.x(), area.middle.y(), (low + high) / 2};
  read_moments(hull, area.middle, out);
  return true;
}

}  // namespace

void center_small_parts(const std::vector<Vector3f>& position, const std::vector<int>& part,
                        std::vector<Surroundings>& around) {
  std::vector<std::vector<std::size_t>> members;
  std::size_t total = 0;
  for (std::size_t i = 0; i < part.size(); ++i) {
    if (part[i] < 0) continue;
    ++total;
    const auto id = static_cast<std::size_t>(part[i]);
    if (id >= members.size()) members.resize(id + 1);
    members[id].push_back(i);
  }
  // As many as a sample of the usual size would hold.
  const double share =
      std::min(1.0, static_cast<double>(surroundings_sample) / std::max<std::size_t>(total, 1));
  for (const auto& indices : members) {
    std::vector<Vector3f> points;
    for (const std::size_t i : indices) points.push_back(position[i]);
    Surroundings one;
    if (points.empty() || !surround(points, one)) continue;
    one.neighbours = static_cast<int>(std::lround(share * static_cast<double>(points.size())));
    for (const std::size_t i : indices) around[i] = one;
  }
}

}  // namespace flowscope
