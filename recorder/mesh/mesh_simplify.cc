#include "recorder/mesh/mesh_simplify.h"

#include <Eigen/LU>
#include <algorithm>
#include <queue>
#include <set>

namespace flowscope {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<int, 3>;

constexpr double kBorder = 10;  ///< weight of an open edge's place against that of a face

/// Sum of squared distances from planes, each weighted by its area.
struct Quadric {
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  Vector3d linear = Vector3d::Zero();
  double constant = 0;

  void add(const Vector3d& normal, double offset, double weight) {
    square += weight * normal * normal.transpose();
    linear -= weight * offset * normal;
    constant += weight * offset * offset;
  }
  void add(const Quadric& other) {
    square += other.square;
    linear += other.linear;
    constant += other.constant;
  }
  double at(const Vector3d& p) const { return p.dot(square * p) + 2 * linear.dot(p) + constant; }
};

struct Collapse {
  double cost = 0;
  int a = 0, b = 0, version_a = 0, version_b = 0;
  Vector3d to{0, 0, 0};
  bool operator<(const Collapse& other) const {  // the cheapest on top; ties by number
    return cost != other.cost ? cost > other.cost : std::pair(a, b) > std::pair(other.a, other.b);
  }
};

class Simplifier {
 public:
  explicit Simplifier(const TriangleMesh& mesh)
      : vertices_(mesh.vertices),
        triangles_(mesh.triangles),
        alive_(mesh.triangles.size(), true),
        around_(mesh.vertices.size()),
        version_(mesh.vertices.size(), 0),
        quadrics_(mesh.vertices.size()) {
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      for (const int v : triangles_[i]) around(v).push_back(static_cast<int>(i));
    for (const Triangle& t : triangles_) add_planes(t);
  }

  TriangleMesh down_to(std::size_t most) {
    std::size_t left = triangles_.size();
    for (int v = 0; v < static_cast<int>(vertices_.size()); ++v)
      for (const int other : neighbours(v))
        if (v < other) offer(v, other);
    for (; left > most && !queue_.empty();) {
      const Collapse next = queue_.top();
      queue_.pop();
      if (version(next.a) != next.version_a || version(next.b) != next.version_b) continue;
      if (!may(next)) continue;
      left -= collapse(next);
    }
    return result();
  }

 private:
  Vector3d& at(int v) { return vertices_[static_cast<std::size_t>(v)]; }
  std::vector<int>& around(int v) { return around_[static_cast<std::size_t>(v)]; }
  int& version(int v) { return version_[static_cast<std::size_t>(v)]; }
  Quadric& quadric(int v) { return quadrics_[static_cast<std::size_t>(v)]; }
  Triangle& triangle(int i) { return triangles_[static_cast<std::size_t>(i)]; }
  static bool has(const Triangle& t, int v) { return t[0] == v || t[1] == v || t[2] == v; }

  Vector3d normal(const Triangle& t) { return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])); }

  void add_planes(const Triangle& t) {
    const Vector3d n = normal(t);
    const double area = n.norm();
    if (area <= 0) return;
    for (const int v : t) quadric(v).add(n / area, n.dot(at(t[0])) / area, area);
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      const auto both = std::ranges::count_if(around(a), [&](int i) { return has(triangle(i), b); });
      if (both != 1) continue;
      const Vector3d edge = at(b) - at(a), side = edge.cross(n).normalized();
      for (const int v : {a, b}) quadric(v).add(side, side.dot(at(a)), kBorder * edge.squaredNorm());
    }
  }

  std::set<int> neighbours(int v) {
    std::set<int> found;
    for (const int i : around(v))
      for (const int other : triangle(i))
        if (other != v) found.insert(other);
    return found;
  }

  void offer(int a, int b) {
    Quadric sum = quadric(a);
    sum.add(quadric(b));
    Collapse best{1e300, a, b, version(a), version(b)};
    const auto consider = [&](const Vector3d& p) {
      const double cost = std::max(0.0, sum.at(p));
      if (cost < best.cost) best.cost = cost, best.to = p;
    };
    const double reach = (at(a) - at(b)).norm();
    const Vector3d middle = 0.5 * (at(a) + at(b));
    for (const Vector3d& p : {at(a), at(b), middle}) consider(p);
    const Eigen::FullPivLU<Eigen::Matrix3d> solver(sum.square);
    if (solver.rcond() > 1e-6) {
      const Vector3d p = solver.solve(-sum.linear);
      if ((p - middle).norm() < reach) consider(p);
    }
    best.cost += 1e-9 * reach * reach * reach * reach;  // on flat ground short edges go first
    queue_.push(best);
  }

  /// Neither a tunnel closes nor a face turns over.
  bool may(const Collapse& c) {
    const std::set<int> of_a = neighbours(c.a), of_b = neighbours(c.b);
    std::size_t common = 0, faces = 0;
    for (const int v : of_a) common += of_b.contains(v);
    for (const int i : around(c.a)) faces += has(triangle(i), c.b);
    if (common != faces) return false;
    for (const int v : {c.a, c.b}) {
      const int other = v == c.a ? c.b : c.a;
      for (const int i : around(v)) {
        const Triangle& t = triangle(i);
        if (has(t, other)) continue;
        const Vector3d before = normal(t), kept = at(v);
        at(v) = c.to;
        const Vector3d after = normal(t);
        at(v) = kept;
        if (before.dot(after) <= 0.2 * before.norm() * after.norm()) return false;
      }
    }
    return true;
  }

  /// How many triangles went.
  std::size_t collapse(const Collapse& c) {
    std::size_t gone = 0;
    at(c.a) = c.to;
    quadric(c.a).add(quadric(c.b));
    for (const int i : around(c.b)) {
      Triangle& t = triangle(i);
      if (has(t, c.a)) {
        alive_[static_cast<std::size_t>(i)] = false;
        ++gone;
        for (const int v : t)
          if (v != c.b) std::erase(around(v), i);
        continue;
      }
      std::ranges::replace(t, c.b, c.a);
      around(c.a).push_back(i);
    }
    around(c.b).clear();
    ++version(c.a), ++version(c.b);
    for (const int other : neighbours(c.a)) offer(std::min(c.a, other), std::max(c.a, other));
    return gone;
  }

  TriangleMesh result() {
    TriangleMesh mesh;
    std::vector<int> to(vertices_.size(), -1);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (!alive_[i]) continue;
      Triangle t = triangles_[i];
      for (int& v : t) {
        int& index = to[static_cast<std::size_t>(v)];
        if (index < 0) {
          index = static_cast<int>(mesh.vertices.size());
          mesh.vertices.push_back(at(v));
        }
        v = index;
      }
      mesh.triangles.push_back(t);
    }
    return mesh;
  }

  std::vector<Vector3d> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<bool> alive_;
  std::vector<std::vector<int>> around_;  ///< triangles at each corner
  std::vector<int> version_;
  std::vector<Quadric> quadrics_;
  std::priority_queue<Collapse> queue_;
};

}  // namespace

TriangleMesh simplified(const TriangleMesh& mesh, std::size_t most_triangles) {
  if (mesh.triangles.size() <= most_triangles) return {mesh.vertices, mesh.triangles};
  return Simplifier(mesh).down_to(most_triangles);
}

}  // namespace flowscope
