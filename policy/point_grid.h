// Points in the cells of a grid, to find those near a place without looking at all.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace flowscope {

/// Cells are at least `side_m` wide, wider where the points spread over so much space that the cells would
/// outnumber them by far. Throws std::invalid_argument for positions that are not finite.
class PointGrid {
 public:
  PointGrid(std::span<const Eigen::Vector3f> position, float side_m);

  /// Slots: positions of points in the order of their cells.
  const std::vector<int>& index() const { return index_; }
  const std::vector<Eigen::Vector3f>& position() const { return position_; }

  /// Calls visit(first, last) for ranges of slots that hold every point within `radius_m` of `center` and
  /// others. Each slot comes at most once.
  template <typename Visit>
  void near(const Eigen::Vector3f& center, float radius_m, Visit&& visit) const {
    const float reach = 1.0001f * radius_m + 1e-6f;  // more than rounding can lose
    const std::array<int, 3> from = cell_of(center - Eigen::Vector3f::Constant(reach));
    const std::array<int, 3> to = cell_of(center + Eigen::Vector3f::Constant(reach));
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y) {
        const auto row = static_cast<std::size_t>((z * count_[1] + y) * count_[0]);
        const int first = first_[row + static_cast<std::size_t>(from[0])];
        const int last = first_[row + static_cast<std::size_t>(to[0]) + 1];
        if (first < last) visit(first, last);
      }
  }

 private:
  std::array<int, 3> cell_of(const Eigen::Vector3f& p) const {
    std::array<int, 3> cell;
    for (int a = 0; a < 3; ++a)
      cell[static_cast<std::size_t>(a)] =
          static_cast<int>(std::min(std::max((p[a] - low_[a]) / side_m_, 0.f),
                                    static_cast<float>(count_[static_cast<std::size_t>(a)] - 1)));
    return cell;
  }

  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  float side_m_;
  std::array<int, 3> count_{1, 1, 1};
  std::vector<int> first_;  ///< [cells + 1] first slot of each cell
  std::vector<int> index_;  ///< [n] point of each slot, ascending within a cell
  std::vector<Eigen::Vector3f> position_;
};

}  // namespace flowscope
