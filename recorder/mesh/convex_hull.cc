#include "recorder/mesh/convex_hull.h"

#include <libqhull_r/qhull_ra.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <numbers>
#include <set>

namespace flowscope {
namespace {

using Eigen::Vector3d;

/// Relative to the size: flatter than this is flat.
constexpr double kFlat = 1e-7;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// One run of Qhull and its memory. What it complains about goes nowhere: a run that fails found no hull.
class QhullRun {
 public:
  explicit QhullRun(const std::vector<Vector3d>& points) : quiet_(std::fopen("/dev/null", "w")) {
    flat_.reserve(3 * points.size());
    for (const Vector3d& p : points) flat_.insert(flat_.end(), p.data(), p.data() + 3);
    char options[] = "qhull Qt";
    qh_zero(&qh_, quiet_.get());
    ok_ = qh_new_qhull(&qh_, 3, static_cast<int>(points.size()), flat_.data(), False, options, nullptr,
                       quiet_.get()) == 0;
  }
  ~QhullRun() {
    qh_freeqhull(&qh_, !qh_ALL);
    int left = 0, total = 0;
    qh_memfreeshort(&qh_, &left, &total);
  }
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;

  bool ok() const { return ok_; }
  qhT* qh() { return &qh_; }

 private:
  std::unique_ptr<std::FILE, CloseFile> quiet_;
  std::vector<double> flat_;
  qhT qh_{};
  bool ok_ = false;
};

/// Flat and lost shapes make Qhull complain; most are seen before.
bool has_volume(const std::vector<Vector3d>& points) {
  if (points.size() < 4) return false;
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread, Eigen::EigenvaluesOnly);
  return axes.eigenvalues()[0] > kFlat * kFlat * axes.eigenvalues()[2];
}

}  // namespace

TriangleMesh convex_hull(const std::vector<Vector3d>& points) {
  TriangleMesh mesh;
  if (!has_volume(points)) return mesh;
  QhullRun run(points);
  if (!run.ok()) return mesh;
  qhT* qh = run.qh();  // the macros below want this name
  std::map<int, int> index_of;
  const auto index = [&](int point) {
    const auto [it, fresh] = index_of.try_emplace(point, static_cast<int>(mesh.vertices.size()));
    if (fresh) mesh.vertices.push_back(points[static_cast<std::size_t>(point)]);
    return it->second;
  };
  facetT* facet = nullptr;
  vertexT *vertex = nullptr, **vertexp = nullptr;
  FORALLfacets {
    std::vector<int> corners;
    FOREACHvertex_(facet->vertices) corners.push_back(index(qh_pointid(qh, vertex->point)));
    if (corners.size() != 3) continue;
    const auto at = [&](std::size_t k) -> const Vector3d& {
      return mesh.vertices[static_cast<std::size_t>(corners[k])];
    };
    const Eigen::Map<const Vector3d> outwards(facet->normal);
    const bool right = (at(1) - at(0)).cross(at(2) - at(0)).dot(outwards) > 0;
    mesh.triangles.push_back(right ? std::array<int, 3>{corners[0], corners[1], corners[2]}
                                   : std::array<int, 3>{corners[0], corners[2], corners[1]});
  }
  const double size = extent_of(points).size().norm();
  if (!(mass_properties(mesh).volume > kFlat * size * size * size)) return {};
  return mesh;
}

double hull_volume(const std::vector<Vector3d>& points) {
  if (!has_volume(points)) return 0;
  QhullRun run(points);
  if (!run.ok()) return 0;
  qh_getarea(run.qh(), run.qh()->facet_list);
  const double size = extent_of(points).size().norm();
  return run.qh()->totvol > kFlat * size * size * size ? run.qh()->totvol : 0;
}

TriangleMesh simple_hull(const std::vector<Vector3d>& points, int most) {
  TriangleMesh hull = convex_hull(points);
  if (static_cast<int>(hull.vertices.size()) <= most) return hull;
  std::set<std::size_t> chosen;
  const auto choose = [&](const Vector3d& direction) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < hull.vertices.size(); ++i)
      if (hull.vertices[i].dot(direction) > hull.vertices[best].dot(direction)) best = i;
    chosen.insert(best);
  };
  for (int axis = 0; axis < 3; ++axis) choose(Vector3d::Unit(axis)), choose(-Vector3d::Unit(axis));
  // A spiral of directions, each the golden angle further.
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const int directions = most - 6;
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - (2.0 * i + 1) / directions, r = std::sqrt(1 - z * z);
    choose({r * std::cos(golden * i), r * std::sin(golden * i), z});
  }
  std::vector<Vector3d> few;
  for (const std::size_t i : chosen) few.push_back(hull.vertices[i]);
  return convex_hull(few);
}

}  // namespace flowscope
