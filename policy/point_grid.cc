#include "policy/point_grid.h"

#include <numeric>
#include <stdexcept>

namespace flowscope {

using Eigen::Vector3f;

PointGrid::PointGrid(std::span<const Vector3f> position, float side_m) : side_m_(side_m) {
  if (position.empty()) {
    first_.assign(2, 0);
    return;
  }
  Vector3f high = low_ = position[0];
  for (const Vector3f& p : position) {
    if (!p.allFinite()) throw std::invalid_argument("a point's position is not finite");
    low_ = low_.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double most_cells = 4096 + 8.0 * static_cast<double>(position.size());
  const auto cells_of_side = [&](double side) -> Eigen::Array3d {
    return ((high - low_).cast<double>() / side).array().floor() + 1;
  };
  while (cells_of_side(side_m_).prod() > most_cells) side_m_ *= 1.3f;
  for (int a = 0; a < 3; ++a)
    count_[static_cast<std::size_t>(a)] = static_cast<int>(cells_of_side(side_m_)[a]);

  std::vector<std::size_t> cell(position.size());
  first_.assign(static_cast<std::size_t>(count_[0] * count_[1] * count_[2]) + 2, 0);
  for (std::size_t i = 0; i < position.size(); ++i) {
    const std::array<int, 3> c = cell_of(position[i]);
    cell[i] = static_cast<std::size_t>((c[2] * count_[1] + c[1]) * count_[0] + c[0]);
    ++first_[cell[i] + 2];
  }
  // Shifted by one: filling moves the begin of each cell to its end, the begin of the next.
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  index_.resize(position.size());
  position_.resize(position.size());
  for (std::size_t i = 0; i < position.size(); ++i) {
    const auto slot = static_cast<std::size_t>(first_[cell[i] + 1]++);
    index_[slot] = static_cast<int>(i);
    position_[slot] = position[i];
  }
  first_.pop_back();
}

}  // namespace flowscope
