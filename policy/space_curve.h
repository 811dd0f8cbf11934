// Curves that visit every cell of a cube: a sequence of points along one has its neighbours in space near.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace flowscope {

/// A cube of 1024 cells along each side; points outside count as at its faces. side > 0, metres.
struct CurveCube {
  Eigen::Vector3f low = Eigen::Vector3f::Zero();
  float side = 1;
};

inline constexpr int kCurveBits = 10;  ///< per axis

/// Each coordinate in 0 … 2^bits - 1, bits at most 10.
using CurveCell = std::array<std::uint32_t, 3>;
CurveCell curve_cell(const CurveCube& cube, const Eigen::Vector3f& point);

/// Bits of a 10-bit number, two zeros between each.
constexpr std::uint32_t spread_bits(std::uint32_t v) {
  v = (v | v << 16) & 0x030000FF;
  v = (v | v << 8) & 0x0300F00F;
  v = (v | v << 4) & 0x030C30C3;
  return (v | v << 2) & 0x09249249;
}
/// Bits of z, y and x in turn.
constexpr std::uint32_t morton_code(const CurveCell& cell) {
  return spread_bits(cell[0]) | spread_bits(cell[1]) << 1 | spread_bits(cell[2]) << 2;
}
/// Place along the Hilbert curve, whose every step goes to a neighbouring cell (Skilling 2004,
/// doi:10.1063/1.1751381).
std::uint32_t hilbert_code(const CurveCell& cell, int bits = kCurveBits);
/// The same curve with x and y exchanged: it keeps other neighbours together (as in PointMamba,
/// arXiv:2402.10739).
std::uint32_t transposed_hilbert_code(const CurveCell& cell, int bits = kCurveBits);

}  // namespace flowscope
