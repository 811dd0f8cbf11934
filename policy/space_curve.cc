#include "policy/space_curve.h"

namespace flowscope {
CurveCell curve_cell(const CurveCube& cube, const Eigen::Vector3f& point) {
  const Eigen::Vector3f u = ((point - cube.low) / cube.side * 1023.f).cwiseMax(0.f).cwiseMin(1023.f);
  return {static_cast<std::uint32_t>(u.x()), static_cast<std::uint32_t>(u.y()),
          static_cast<std::uint32_t>(u.z())};
}

std::uint32_t hilbert_code(const CurveCell& of, int bits) {
  CurveCell cell = of;
  // From the coarsest halving to the finest: turn what lies below into the curve's first octant.
  for (std::uint32_t half = 1u << (bits - 1); half > 1; half >>= 1) {
    const std::uint32_t below = half - 1;
    for (std::uint32_t& axis : cell) {
      if (axis & half) {
        cell[0] ^= below;
      } else {
        const std::uint32_t exchange = (cell[0] ^ axis) & below;
        cell[0] ^= exchange;
        axis ^= exchange;
      }
    }
  }
  // The octants are numbered by a Gray code.
  cell[1] ^= cell[0];
  cell[2] ^= cell[1];
  std::uint32_t flip = 0;
  for (std::uint32_t half = 1u << (bits - 1); half > 1; half >>= 1)
    if (cell[2] & half) flip ^= half - 1;
  return spread_bits(cell[0] ^ flip) << 2 | spread_bits(cell[1] ^ flip) << 1 | spread_bits(cell[2] ^ flip);
}

std::uint32_t transposed_hilbert_code(const CurveCell& cell, int bits) {
  return hilbert_code({cell[1], cell[0], cell[2]}, bits);
}

}  // namespace flowscope
