// The point encoder: groups against plain loops, and what each token can see.
#include "policy/point_encoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

#include "policy/point_groups.h"
#include "policy/random.h"
#include "policy/space_curve.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

NetworkShape small_shape() {
  NetworkShape shape;
  shape.channels = 16;
  shape.d_state = 4;
  shape.point_blocks = 2;
  shape.point_groups = 12;
  shape.group_size = 6;
  return shape;
}

std::vector<Vector3f> cloud(int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vector3f> points(static_cast<std::size_t>(count));
  for (Vector3f& p : points)
    for (float& v : p) v = static_cast<float>(random.uniform(-0.2, 0.2));
  return points;
}

torch::Tensor as_tensor(const std::vector<Vector3f>& points) {
  torch::Tensor t = torch::empty({static_cast<std::int64_t>(points.size()), 3});
  for (std::size_t i = 0; i < points.size(); ++i)
    std::copy_n(points[i].data(), 3, t.data_ptr<float>() + 3 * i);
  return t;
}

struct Input {
  torch::Tensor tokens, position;
};
Input random_input(std::int64_t batch, int n, int channels = small_shape().channels) {
  torch::manual_seed(3);
  std::vector<torch::Tensor> position;
  for (std::int64_t b = 0; b < batch; ++b) position.push_back(as_tensor(cloud(n, 20 + std::uint64_t(b))));
  return {torch::randn({batch, n, channels}), torch::stack(position)};
}

TEST(PointGroups, HoldTheNearestPointsOfFarthestCentres) {
  auto points = cloud(300, 4);
  for (std::size_t i = 0; i < 40; ++i) points[299 - i] = points[i];  // equally near: the first counts
  const PointGroups g = group_points(points, 10, 7);
  ASSERT_EQ(g.center.size(), 10u);
  ASSERT_EQ(g.neighbour.size(), 70u);
  for (std::size_t i = 0; i < g.center.size(); ++i) {
    const Vector3f& center = points[static_cast<std::size_t>(g.center[i])];
    std::vector<int> all(points.size());
    std::iota(all.begin(), all.end(), 0);
    std::stable_sort(all.begin(), all.end(), [&](int a, int b) {
      return (points[static_cast<std::size_t>(a)] - center).squaredNorm() <
             (points[static_cast<std::size_t>(b)] - center).squaredNorm();
    });
    for (std::size_t j = 0; j < 7; ++j) EXPECT_EQ(g.neighbour[7 * i + j], all[j]) << "group " << i;
    // No later centre is farther from those before than this one is.
    if (i == 0) continue;
    const auto gap = [&](const Vector3f& p) {
      float nearest = 1e9f;
      for (std::size_t j = 0; j < i; ++j)
        nearest = std::min(nearest, (p - points[static_cast<std::size_t>(g.center[j])]).norm());
      return nearest;
    };
    for (const Vector3f& p : points) EXPECT_LE(gap(p), gap(center) + 1e-6f);
  }
}

TEST(PointGroups, HoldPointsOfTheCloudHoweverFarApart) {
  std::vector<Vector3f> points;  // their squared distances are infinite
  for (int i = 0; i < 70; ++i) points.push_back(Vector3f::Constant(i % 2 == 0 ? 1e30f : -1e30f));
  const PointGroups g = group_points(points, 3, 50);
  for (const int i : g.neighbour) EXPECT_TRUE(i >= 0 && i < 70) << i;
  points[9].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(group_points(points, 3, 5), std::invalid_argument);
}

TEST(PointGroups, AreTheSameWhereTheyAreFoundInParts) {
  const auto points = cloud(90, 8);
  const PointGroups whole = group_points(points, 21, 5);
  const PointGroups parts = group_points(points, 21, 5, [](int count, const auto& part) {
    for (int first = count - 1; first >= 0; first -= 4) part(std::max(0, first - 3), first + 1);
  });
  EXPECT_EQ(parts.neighbour, whole.neighbour);
  EXPECT_EQ(parts.center, whole.center);
  EXPECT_EQ(parts.reach_m, whole.reach_m);
}

TEST(PointGroups, AreReadAlongBothCurves) {
  const auto points = cloud(200, 4);
  const PointGroups g = group_points(points, 50, 4);
  Vector3f low = points[0], high = points[0];
  for (const Vector3f& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const CurveCube cube{low, (high - low).maxCoeff()};
  const auto cell = [&](int group) {
    return curve_cell(cube, points[static_cast<std::size_t>(g.center[static_cast<std::size_t>(group)])]);
  };
  EXPECT_EQ(std::set<int>(g.hilbert.begin(), g.hilbert.end()).size(), 50u);
  EXPECT_EQ(std::set<int>(g.transposed_hilbert.begin(), g.transposed_hilbert.end()).size(), 50u);
  EXPECT_NE(g.hilbert, g.transposed_hilbert);
  for (std::size_t i = 1; i < 50; ++i) {
    EXPECT_LE(hilbert_code(cell(g.hilbert[i - 1])), hilbert_code(cell(g.hilbert[i])));
    EXPECT_LE(transposed_hilbert_code(cell(g.transposed_hilbert[i - 1])),
              transposed_hilbert_code(cell(g.transposed_hilbert[i])));
  }
}

TEST(PointEncoder, GroupTokensAreThoseOfThePlainFormula) {
  NetworkShape shape = small_shape();
  shape.point_blocks = 0;  // the sequence as it enters the blocks
  const Input in = random_input(2, 40);
  PointEncoder encoder(shape, "mamba");
  const torch::NoGradGuard no_grad;
  const GroupTokens out = encoder->forward(in.tokens, in.position);
  const auto w = [&](const std::string& name) { return encoder->named_parameters()[name]; };
  for (std::int64_t b = 0; b < 2; ++b) {
    std::vector<Vector3f> points;
    for (std::int64_t i = 0; i < 40; ++i)
      points.emplace_back(Eigen::Map<const Vector3f>(in.position.data_ptr<float>() + 3 * (40 * b + i)));
    const PointGroups g = group_points(points, shape.point_groups, shape.group_size);
    const torch::Tensor x = in.position[b], middle = x.mean(0);
    const torch::Tensor spread = (x - middle).square().sum(1).mean().sqrt();
    for (std::size_t at = 0; at < 24; ++at) {
      const std::size_t copy = at / 12;
      const auto group = static_cast<std::size_t>(copy == 0 ? g.hilbert[at] : g.transposed_hilbert[at - 12]);
      const std::int64_t center = g.center[group];
      EXPECT_EQ(out.center[b][static_cast<std::int64_t>(at)].item<std::int64_t>(), center);
      std::vector<torch::Tensor> h, u;
      for (std::size_t j = 0; j < 6; ++j) {
        const std::int64_t point = g.neighbour[6 * group + j];
        h.push_back(torch::gelu(w("token_in.weight").mv(in.tokens[b][point]) + w("token_in.bias") +
                                w("place_in.weight").mv((x[point] - x[center]) / g.reach_m)));
      }
      const torch::Tensor pooled = torch::stack(h).amax(0);
      for (const torch::Tensor& hj : h)
        u.push_back(torch::gelu(w("inner.weight").mv(hj) + w("inner.bias") + w("pooled.weight").mv(pooled)));
      torch::Tensor expected = w("out.weight").mv(torch::stack(u).amax(0)) + w("out.bias");
      expected =
          expected + w("place.2.bias") +
          w("place.2.weight")
              .mv(torch::gelu(w("place.0.bias") + w("place.0.weight").mv((x[center] - middle) / spread)));
      expected = expected * w("scale")[static_cast<std::int64_t>(copy)] +
                 w("shift")[static_cast<std::int64_t>(copy)];
      EXPECT_TRUE(torch::allclose(out.token[b][static_cast<std::int64_t>(at)], expected, 1e-4, 1e-5))
          << "item " << b << ", token " << at;
    }
  }
}

TEST(PointEncoder, GradientReachesEveryTokenOfAGroupAndEveryWeight) {
  NetworkShape shape = small_shape();
  shape.channels = 64;  // enough maxima for every point of a group to be one of them
  Input in = random_input(2, 40, shape.channels);
  in.tokens.requires_grad_();
  PointEncoder encoder(shape, "mamba");
  const GroupTokens out = encoder->forward(in.tokens, in.position);
  EXPECT_EQ(out.token.sizes(), (torch::IntArrayRef{2, 24, 64}));
  EXPECT_EQ(out.center.sizes(), (torch::IntArrayRef{2, 24}));
  (out.token * torch::randn_like(out.token)).sum().backward();
  for (const auto& weight : encoder->named_parameters()) {
    ASSERT_TRUE(weight.value().grad().defined()) << weight.key();
    EXPECT_GT(weight.value().grad().abs().max().item<float>(), 0) << weight.key();
  }
  for (std::int64_t b = 0; b < 2; ++b) {
    std::vector<Vector3f> points;
    for (std::int64_t i = 0; i < 40; ++i)
      points.emplace_back(Eigen::Map<const Vector3f>(in.position.data_ptr<float>() + 3 * (40 * b + i)));
    const PointGroups g = group_points(points, shape.point_groups, shape.group_size);
    const std::set<int> used(g.neighbour.begin(), g.neighbour.end());
    EXPECT_GT(used.size(), 30u);
    for (int i = 0; i < 40; ++i) {
      const float gradient = in.tokens.grad()[b][i].abs().max().item<float>();
      EXPECT_EQ(gradient > 0, used.contains(i)) << "token " << i << " of item " << b;
    }
  }
}

TEST(PointEncoder, DoesNotCareInWhichOrderThePointsCome) {
  const Input in = random_input(1, 60);
  PointEncoder encoder(small_shape(), "mamba");
  const torch::NoGradGuard no_grad;
  const GroupTokens plain = encoder->forward(in.tokens, in.position);
  const torch::Tensor order = torch::randperm(60);
  const GroupTokens permuted =
      encoder->forward(in.tokens.index_select(1, order), in.position.index_select(1, order));
  EXPECT_TRUE(torch::equal(order.index_select(0, permuted.center[0]), plain.center[0]));
  EXPECT_TRUE(torch::allclose(permuted.token, plain.token, 1e-4, 1e-5));
}

TEST(PointEncoder, TheSecondReadingSeesWhatTheFirstHadStillAhead) {
  const Input in = random_input(1, 60);
  PointEncoder encoder(small_shape(), "mamba");
  const torch::NoGradGuard no_grad;
  const GroupTokens before = encoder->forward(in.tokens, in.position);
  const std::int64_t last = before.center[0][11].item<std::int64_t>();
  const torch::Tensor changed = in.tokens.clone();
  changed[0][last] += 1;
  const GroupTokens after = encoder->forward(changed, in.position);
  const torch::Tensor difference = (after.token - before.token).abs().amax(-1)[0];
  std::vector<Vector3f> points;
  for (std::int64_t i = 0; i < 60; ++i)
    points.emplace_back(Eigen::Map<const Vector3f>(in.position.data_ptr<float>() + 3 * i));
  const PointGroups g = group_points(points, 12, 6);
  for (std::int64_t at = 0; at < 12; ++at) {  // until the first group that holds the point
    const auto group = 6 * g.hilbert[static_cast<std::size_t>(at)];
    if (std::find(g.neighbour.begin() + group, g.neighbour.begin() + group + 6, last) !=
        g.neighbour.begin() + group + 6)
      break;
    EXPECT_EQ(difference[at].item<float>(), 0) << "token " << at;
  }
  EXPECT_EQ(difference[0].item<float>(), 0) << "the front of the first reading comes before the change";
  EXPECT_GT(difference[11].item<float>(), 1e-6f);
  for (std::int64_t at = 12; at < 24; ++at) EXPECT_GT(difference[at].item<float>(), 1e-7f) << "token " << at;
}

TEST(PointEncoder, RefusesWhatDoesNotFit) {
  PointEncoder encoder(small_shape(), "mamba");
  const Input in = random_input(2, 40);
  EXPECT_THROW(encoder->forward(in.tokens[0], in.position), std::invalid_argument);
  EXPECT_THROW(encoder->forward(in.tokens, in.position.narrow(1, 0, 39)), std::invalid_argument);
  EXPECT_THROW(encoder->forward(in.tokens.narrow(2, 0, 8), in.position), std::invalid_argument);
  try {
    encoder->forward(in.tokens.narrow(1, 0, 11), in.position.narrow(1, 0, 11));
    FAIL() << "fewer points than groups";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("at least 12"), std::string::npos) << e.what();
  }
  EXPECT_THROW(encoder->forward(in.tokens, in.position / 0.0), std::invalid_argument);
  NetworkShape none = small_shape();
  none.point_groups = 0;
  EXPECT_THROW(PointEncoder(none, "mamba"), std::invalid_argument);
  EXPECT_THROW(group_points(cloud(5, 1), 6, 2), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
