// Curves that fill a cube.
#include "policy/space_curve.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

namespace flowscope {
namespace {

int steps_between(const CurveCell& a, const CurveCell& b) {
  int steps = 0;
  for (std::size_t i = 0; i < 3; ++i) steps += std::abs(static_cast<int>(a[i]) - static_cast<int>(b[i]));
  return steps;
}

TEST(SpaceCurve, HilbertVisitsEveryCellOnceByStepsToNeighbours) {
  for (int bits = 1; bits <= 5; ++bits) {
    const std::uint32_t side = 1u << bits;
    for (const auto code : {hilbert_code, transposed_hilbert_code}) {
      std::vector<CurveCell> cell_at(side * side * side);
      std::vector<int> visits(cell_at.size());
      for (std::uint32_t x = 0; x < side; ++x)
        for (std::uint32_t y = 0; y < side; ++y)
          for (std::uint32_t z = 0; z < side; ++z) {
            const std::uint32_t at = code({x, y, z}, bits);
            ASSERT_LT(at, cell_at.size());
            cell_at[at] = {x, y, z};
            ++visits[at];
          }
      for (std::size_t i = 0; i < cell_at.size(); ++i) {
        ASSERT_EQ(visits[i], 1) << "cell " << i << " of " << bits << " bits";
        ASSERT_EQ(steps_between(cell_at[i == 0 ? 1 : i - 1], cell_at[i]), 1)
            << i << " of " << bits << " bits";
      }
    }
  }
}

TEST(SpaceCurve, TransposedRunsTheOtherWay) {
  EXPECT_NE(hilbert_code({1, 0, 0}, 1), transposed_hilbert_code({1, 0, 0}, 1));
  EXPECT_EQ(hilbert_code({3, 5, 9}), transposed_hilbert_code({5, 3, 9}));
}

TEST(SpaceCurve, MortonInterleavesBitsWithXLowest) {
  EXPECT_EQ(morton_code({1, 0, 0}), 1u);
  EXPECT_EQ(morton_code({0, 1, 0}), 2u);
  EXPECT_EQ(morton_code({0, 0, 1}), 4u);
  EXPECT_EQ(morton_code({3, 1, 2}), 0b101011u);
  EXPECT_EQ(morton_code({1023, 1023, 1023}), (1u << 30) - 1);
}

TEST(SpaceCurve, CellsClampToTheCube) {
  const CurveCube cube{{-1, -1, -1}, 2};
  EXPECT_EQ(curve_cell(cube, {-5, 0, 5}), (CurveCell{0, 511, 1023}));
}

}  // namespace
}  // namespace flowscope
