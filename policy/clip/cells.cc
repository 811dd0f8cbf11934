#include "policy/clip/cells.h"

#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

namespace flowscope {
namespace {

struct Hit {
  int x, y;
  Eigen::Vector3f position, color;
};

/// A view, and where its pixels stand when its camera does not say it.
struct PlacedView {
  const View& view;
  const std::vector<Eigen::Vector3d>* places;
  Eigen::Vector3d at(int x, int y) const {
    if (places) return (*places)[static_cast<std::size_t>(y) * view.camera.width + x];
    return view.camera.unproject(x + 0.5, y + 0.5, view.depth.at(x, y));
  }
};

std::vector<Hit> hits_under(const PlacedView& placed, const Box& workspace, int left, int top, int stride) {
  const View& view = placed.view;
  std::vector<Hit> hits;
  for (int y = top; y < top + stride; ++y) {
    for (int x = left; x < left + stride; ++x) {
      const float depth = view.depth.at(x, y);
      if (!std::isfinite(depth) || depth <= 0) continue;
      const Eigen::Vector3d p = placed.at(x, y);
      if (!workspace.contains(p)) continue;
      const std::uint8_t* rgb = view.rgb.at(x, y);
      hits.push_back({x, y, p.cast<float>(), Eigen::Vector3f(rgb[0], rgb[1], rgb[2]) / 255.f});
    }
  }
  return hits;
}

std::optional<CellPlace> lift(const PlacedView& view, const Box& workspace, int left, int top, int stride) {
  const std::vector<Hit> hits = hits_under(view, workspace, left, top, stride);
  if (hits.empty()) return std::nullopt;
  CellPlace cell;
  cell.x = static_cast<float>(left) + 0.5f * static_cast<float>(stride);
  cell.y = static_cast<float>(top) + 0.5f * static_cast<float>(stride);
  for (const Hit& hit : hits) {
    cell.position += hit.position / static_cast<float>(hits.size());
    cell.color += hit.color / static_cast<float>(hits.size());
  }
  float nearest = std::numeric_limits<float>::max();
  for (const Hit& hit : hits) {
    const float distance2 = (hit.position - cell.position).squaredNorm();
    if (distance2 >= nearest) continue;
    nearest = distance2;
    cell.pixel_x = hit.x;
    cell.pixel_y = hit.y;
  }
  return cell;
}

void require_whole_cells(const View& view, int stride) {
  const auto pixels = static_cast<std::size_t>(view.camera.width) * view.camera.height;
  const std::string place = "view '" + view.camera.name + "': ";
  if (view.rgb.data.size() != pixels * 3 || view.depth.data.size() != pixels)
    throw std::invalid_argument(place + "picture, depth and camera differ in size");
  if (view.camera.width % stride != 0 || view.camera.height % stride != 0) {
    throw std::invalid_argument(place + std::to_string(view.camera.width) + " x " +
                                std::to_string(view.camera.height) + " pixels are not whole cells of " +
                                std::to_string(stride));
  }
}

}  // namespace

std::vector<CellPlace> lift_cells(const Observation& observation, const Box& workspace, int stride, int count,
                                  const PixelPlaces* places) {
  if (stride < 1 || count < 1) throw std::invalid_argument("cells: stride and count must be positive");
  if (places && places->size() != observation.views.size())
    throw std::invalid_argument("cells: there must be places for every view");
  std::vector<CellPlace> cells;
  for (std::size_t v = 0; v < observation.views.size(); ++v) {
    const View& view = observation.views[v];
    require_whole_cells(view, stride);
    const PlacedView placed{view, places ? &places->at(v) : nullptr};
    for (int top = 0; top < view.camera.height; top += stride) {
      for (int left = 0; left < view.camera.width; left += stride) {
        auto cell = lift(placed, workspace, left, top, stride);
        if (!cell) continue;
        cell->view = static_cast<int>(v);
        cells.push_back(*cell);
      }
    }
  }
  if (cells.empty()) throw std::invalid_argument("cells: no view has a valid point inside the workspace");
  const std::size_t n = cells.size(), tokens = static_cast<std::size_t>(count);
  std::vector<CellPlace> chosen;
  chosen.reserve(tokens);
  for (std::size_t i = 0; i < tokens; ++i)
    chosen.push_back(n > tokens ? cells[i * n / tokens] : cells[i % n]);
  return chosen;
}

}  // namespace flowscope
