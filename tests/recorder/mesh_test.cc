// Volumes, inertias, hulls, cuts and convex parts against formulas.
#include "recorder/mesh/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "recorder/mesh/convex_hull.h"
#include "recorder/mesh/convex_parts.h"
#include "recorder/mesh/mesh_cut.h"
#include "recorder/mesh/mesh_simplify.h"
#include "tests/support/sample_meshes.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;
using testing::box;
using testing::cup;
using testing::l_shape;
using testing::sphere;

TriangleMesh shifted(TriangleMesh mesh, const Vector3d& by) {
  for (Vector3d& v : mesh.vertices) v += by;
  return mesh;
}

void expect_inertia(const MassProperties& found, double xx, double yy, double zz, double tolerance) {
  const Eigen::Matrix3d expected = Vector3d(xx, yy, zz).asDiagonal();
  EXPECT_LT((found.inertia - expected).norm(), tolerance * expected.norm()) << found.inertia;
}

TEST(MassProperties, OfABoxAreExactWhereverItStands) {
  const TriangleMesh mesh = shifted(box({0.2, 0.3, 0.5}), {5, -7, 11});
  const MassProperties p = mass_properties(mesh);
  const double v = 0.2 * 0.3 * 0.5;
  EXPECT_NEAR(p.volume, v, 1e-12 * v);
  EXPECT_LT((p.center - Vector3d(5.1, -6.85, 11.25)).norm(), 1e-12);
  expect_inertia(p, v * (0.09 + 0.25) / 12, v * (0.04 + 0.25) / 12, v * (0.04 + 0.09) / 12, 1e-10);
}

TEST(MassProperties, OfATetrahedronFollowTheFormula) {
  // Corner at the origin, edges a along the axes: I_xx about the corner is V a^2 / 5, about the centre
  // V a^2 (1/5 - 1/8) = 3 V a^2 / 40; products of inertia about the centre are V a^2 (1/16 - 1/20) = V a^2
  // / 80.
  const double a = 0.4, v = a * a * a / 6;
  const TriangleMesh mesh{
      {{0, 0, 0}, {a, 0, 0}, {0, a, 0}, {0, 0, a}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {}};
  ASSERT_TRUE(is_closed(mesh));
  const MassProperties p = mass_properties(mesh);
  EXPECT_NEAR(p.volume, v, 1e-12);
  EXPECT_LT((p.center - Vector3d::Constant(a / 4)).norm(), 1e-12);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(p.inertia(i, k), i == k ? 3 * v * a * a / 40 : v * a * a / 80, 1e-12) << i << k;
}

TEST(MassProperties, OfASphereApproachTheFormula) {
  const double r = 0.1;
  const MassProperties p = mass_properties(shifted(sphere(r, 64, 128), {1, 2, 3}));
  const double v = 4.0 / 3 * std::numbers::pi * r * r * r;
  EXPECT_NEAR(p.volume, v, 2e-3 * v);
  EXPECT_LT((p.center - Vector3d(1, 2, 3)).norm(), 1e-9);
  const double i = 0.4 * v * r * r;
  expect_inertia(p, i, i, i, 4e-3);
}

TEST(Tidy, WeldsTurnsAndDrops) {
  TriangleMesh soup;  // every triangle with corners of its own, every third one turned round
  const TriangleMesh solid = box({0.1, 0.2, 0.3});
  for (std::size_t i = 0; i < solid.triangles.size(); ++i) {
    const int base = static_cast<int>(soup.vertices.size());
    for (const int corner : solid.triangles[i])
      soup.vertices.push_back(solid.vertices[static_cast<std::size_t>(corner)]);
    soup.triangles.push_back(i % 3 == 0 ? std::array<int, 3>{base, base + 2, base + 1}
                                        : std::array<int, 3>{base, base + 1, base + 2});
  }
  soup.triangles.push_back({0, 0, 1});
  soup.triangles.push_back(soup.triangles[4]);
  EXPECT_FALSE(is_closed(soup));
  tidy(soup);
  EXPECT_EQ(soup.vertices.size(), 8u);
  EXPECT_EQ(soup.triangles.size(), 12u);
  EXPECT_TRUE(is_closed(soup));
  EXPECT_NEAR(mass_properties(soup).volume, 0.006, 1e-9);
  TriangleMesh inside_out = solid;
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  tidy(inside_out);
  EXPECT_NEAR(mass_properties(inside_out).volume, 0.006, 1e-12);
}

TEST(Hull, OfPointsOnAndInABox) {
  std::vector<Vector3d> points = box({1, 2, 3}).vertices;
  for (int i = 1; i < 10; ++i) points.emplace_back(0.1 * i, 0.2 * i, 0.3 * i);
  const TriangleMesh hull = convex_hull(points);
  EXPECT_EQ(hull.vertices.size(), 8u);
  EXPECT_TRUE(is_closed(hull));
  EXPECT_NEAR(mass_properties(hull).volume, 6, 1e-9);
  EXPECT_NEAR(hull_volume(points), 6, 1e-9);
  EXPECT_EQ(hull_volume({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.3, 0.3, 0}}), 0);
  EXPECT_TRUE(convex_hull({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}).triangles.empty());
}

TEST(Hull, WithFewerCornersKeepsItsExtent) {
  const TriangleMesh ball = sphere(0.05, 40, 80);
  const TriangleMesh few = simple_hull(ball.vertices, 200);
  EXPECT_LE(few.vertices.size(), 200u);
  EXPECT_LT((extent_of(few.vertices).size() - Vector3d::Constant(0.1)).cwiseAbs().maxCoeff(), 2e-4);
  EXPECT_GT(mass_properties(few).volume, 0.95 * mass_properties(ball).volume);
}

TEST(Cut, HalvesKeepTheVolumeToTheLastDigit) {
  for (const TriangleMesh& mesh : {l_shape(), cup(), sphere(0.05, 12, 20)}) {
    const double whole = mass_properties(mesh).volume;
    for (const Vector3d& direction :
         {Vector3d(1, 0, 0), Vector3d(0, 0, 1), Vector3d(1, 2, -1.5), Vector3d(0.3, -1, 0.2)}) {
      const Vector3d n = direction.normalized();
      for (const double offset : {0.0, 0.006, 0.02, 0.0314}) {
        const Plane plane{n, offset};
        const CutMesh under = below({mesh}, plane, true);
        const TriangleMesh &low = under.mesh, high = below({mesh}, plane.turned(), true).mesh;
        EXPECT_TRUE(low.triangles.empty() || is_closed(low));
        EXPECT_NEAR(mass_properties(low).volume + mass_properties(high).volume, whole, 1e-9 * whole)
            << direction.transpose() << " at " << offset;
        for (const Vector3d& v : low.vertices) ASSERT_LE(n.dot(v), offset + 1e-9);
        // And again, through the caps of the first cut.
        const Plane across{n.unitOrthogonal(), 0.013};
        const double parts = mass_properties(below(under, across, true).mesh).volume +
                             mass_properties(below(under, across.turned(), true).mesh).volume;
        EXPECT_NEAR(parts, mass_properties(low).volume, 1e-9 * whole);
      }
    }
  }
}

TEST(Cut, CornersOutsideThePartAreLeftOut) {
  // A quarter of the cup above its floor: its hull must not reach to the axis.
  const TriangleMesh mesh = cup();
  CutMesh part{mesh};
  for (const Plane& plane : {Plane{{1, 0, 0}, 0}, Plane{{0, 1, 0}, 0}, Plane{{0, 0, -1}, -0.006}})
    part = below(part, plane, true);
  double nearest = 1;
  for (const Vector3d& v : corners_of(part, mesh)) nearest = std::min(nearest, std::hypot(v.x(), v.y()));
  EXPECT_GT(nearest, 0.0355);
  // The middle of a box is a corner of its eighth.
  part = {box({0.2, 0.2, 0.2})};
  for (int axis = 0; axis < 3; ++axis) part = below(part, {Vector3d::Unit(axis), 0.1}, true);
  EXPECT_NEAR(hull_volume(corners_of(part, box({0.2, 0.2, 0.2}))), 0.001, 1e-9);
}

double sum_of_volumes(const std::vector<TriangleMesh>& parts) {
  double sum = 0;
  for (const TriangleMesh& part : parts) sum += mass_properties(part).volume;
  return sum;
}

TEST(ConvexParts, AConvexShapeIsOnePart) {
  EXPECT_EQ(convex_parts(box({0.1, 0.2, 0.3}), {}).size(), 1u);
  EXPECT_EQ(convex_parts(sphere(0.05, 16, 24), {}).size(), 1u);
}

TEST(ConvexParts, AnLShapeIsTwoAndExact) {
  const auto parts = convex_parts(l_shape(), {});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_NEAR(sum_of_volumes(parts), 96e-6, 1e-9 * 96e-6);
}

TEST(ConvexParts, ACupIsHollow) {
  const TriangleMesh mesh = cup();
  const auto parts = convex_parts(mesh, {});
  const double solid = mass_properties(mesh).volume;
  std::printf("cup: %zu parts, volume %.1f %% too large\n", parts.size(),
              100 * (sum_of_volumes(parts) / solid - 1));
  EXPECT_LE(parts.size(), 32u);
  EXPECT_GE(parts.size(), 5u);
  EXPECT_LT(sum_of_volumes(parts), 1.03 * solid);
  // Room for a ball of half the inner radius all the way down.
  for (const TriangleMesh& part : parts)
    for (const Vector3d& v : part.vertices) {
      if (v.z() <= 0.0061) continue;
      EXPECT_GT(std::hypot(v.x(), v.y()), 0.018);
    }
}

struct Excess {
  std::size_t parts = 0;
  double fraction = 0;  ///< of the volume
};

Excess excess_of(TriangleMesh mesh, double scale, int most_parts) {
  for (Vector3d& v : mesh.vertices) v *= scale;
  tidy(mesh);
  PartOptions options;
  options.most_parts = most_parts;
  const auto parts = convex_parts(mesh, options);
  return {parts.size(), sum_of_volumes(parts) / mass_properties(mesh).volume - 1};
}

TriangleMesh dented(TriangleMesh mesh, double radius) {
  for (const Vector3d& dent : {Vector3d(1, 0, 0), Vector3d(-0.3, 0.9, 0.2), Vector3d(0, -0.6, -0.8)})
    for (Vector3d& v : mesh.vertices) v *= 1 - 0.6 * std::exp(-(v / radius - dent).squaredNorm() / 0.16);
  return mesh;
}

TEST(ConvexParts, HolesStayOpenAndTheScaleDoesNotMatter) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.8, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  TriangleMesh turned_nut = testing::ring(6, 0.010, 24, 0.005, 0.008);
  for (Vector3d& v : turned_nut.vertices) v = turn * v;
  struct Case {
    const char* name;
    TriangleMesh mesh;
    double most;  ///< allowed excess with 32 parts
  };
  const std::vector<Case> cases{{"washer", testing::ring(24, 0.05, 24, 0.03, 0.01), 0.02},
                                {"thin washer", testing::ring(40, 0.05, 40, 0.03, 0.0008), 0.02},
                                {"nut", testing::ring(6, 0.010, 24, 0.005, 0.008), 0.02},
                                {"turned nut", turned_nut, 0.02},
                                {"octagon", testing::ring(8, 0.1, 8, 0.07, 0.02), 0.001},
                                {"frame", testing::ring(4, 0.1, 4, 0.08, 0.02), 0.001},
                                {"pocket", testing::pocket(8, 0.1, 0.07, 0.02, 0.01), 0.001},
                                {"cup", cup(), 0.03},
                                {"dents", dented(sphere(0.05, 9, 14), 0.05), 0.1}};
  for (const Case& one : cases) {
    const Excess first = excess_of(one.mesh, 1, 32);
    EXPECT_LE(first.fraction, one.most) << one.name << ": " << first.parts << " parts";
    EXPECT_GT(first.fraction, -0.01) << one.name;
    EXPECT_LE(first.parts, 32u) << one.name;
    const double scale = 0.037;  // no power of two, or all would trivially be alike
    const Excess other = excess_of(one.mesh, scale, 32);
    EXPECT_EQ(other.parts, first.parts) << one.name << " at " << scale;
    EXPECT_NEAR(other.fraction, first.fraction, 1e-3) << one.name << " at " << scale;
  }
}

TEST(ConvexParts, MorePartsLeaveLessExcess) {
  const TriangleMesh narrow = testing::ring(48, 0.05, 48, 0.045, 0.004);
  const Excess few = excess_of(narrow, 1, 8), more = excess_of(narrow, 1, 16),
               many = excess_of(narrow, 1, 33);
  EXPECT_EQ(few.parts, 8u);
  EXPECT_EQ(more.parts, 16u) << "all are used while the aim is far";
  EXPECT_LT(more.fraction, 0.5 * few.fraction);
  EXPECT_LE(many.fraction, 0.025);
}

TEST(ConvexParts, ThingsModelledOneByOneStayApart) {
  TriangleMesh table = shifted(box({0.6, 0.4, 0.02}), {0, 0, 0.4});
  for (const double x : {0.0, 0.55})
    for (const double y : {0.0, 0.35}) append(table, shifted(box({0.05, 0.05, 0.39}), {x, y, 0}));
  const Excess found = excess_of(table, 1, 32);
  EXPECT_EQ(found.parts, 5u);
  EXPECT_NEAR(found.fraction, 0, 1e-6);
}

TEST(Simplified, ThinWallsAndHolesStay) {
  TriangleMesh fine = testing::ring(600, 0.05, 600, 0.03, 0.0008);
  tidy(fine);
  const TriangleMesh few = simplified(fine, 1000);
  EXPECT_LE(few.triangles.size(), 1000u);
  EXPECT_TRUE(is_closed(few));
  EXPECT_NEAR(mass_properties(few).volume, mass_properties(fine).volume, 2e-3 * mass_properties(fine).volume);
  for (const Vector3d& v : few.vertices) EXPECT_NEAR(std::hypot(v.x(), v.y()), 0.04, 0.0101);
}

TEST(ConvexParts, AsFewAsAsked) {
  const auto one = convex_parts(l_shape(), {.most_parts = 1});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(sum_of_volumes(one), hull_volume(l_shape().vertices), 1e-12);
  EXPECT_LE(convex_parts(cup(), {.most_parts = 4}).size(), 4u);
}

TEST(ConvexParts, AnOpenSheetStillGetsParts) {
  TriangleMesh sheet = l_shape();
  sheet.triangles.resize(sheet.triangles.size() - 1);
  ASSERT_FALSE(is_closed(sheet));
  const auto parts = convex_parts(sheet, {});
  EXPECT_GE(parts.size(), 2u);
  EXPECT_LT(sum_of_volumes(parts), 0.75 * hull_volume(sheet.vertices));
  EXPECT_TRUE(convex_parts({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}}, {}).empty());
}

}  // namespace
}  // namespace flowscope
