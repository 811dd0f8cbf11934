// The paper's semantic tokens: every cell of every camera's feature map, lifted to 3-D (§3.3). Four cameras
// of 32 x 32 cells give the 4096 tokens of its Table B.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "policy/scene_points.h"

namespace flowscope {

struct CellPlace {
  int view = 0;
  float x = 0, y = 0;  ///< centre of the cell, pixels: bilinear gathering there gives the cell's own feature
  int pixel_x = 0, pixel_y = 0;       ///< the pixel under the cell whose point is nearest to `position`
  Eigen::Vector3f position{0, 0, 0};  ///< metres, world: mean of the valid points under the cell
  Eigen::Vector3f color{0, 0, 0};     ///< RGB in [0, 1], mean of the same pixels
};

/// Cells of stride x stride pixels (4 for 128-pixel pictures, 8 for 256: 2 << pyramid_level), view by view,
/// row by row. A pixel is valid when its depth is finite and positive and its point inside `workspace`; a
/// cell without one is left out. When more than `count` remain, cell floor(i n / count) is token i, which
/// thins all views alike; when fewer, the tokens begin again from the first, so the number of tokens never
/// depends on the scene. `places` as prepare_scene takes it. Throws std::invalid_argument when no cell
/// remains or a picture is no multiple of `stride`.
std::vector<CellPlace> lift_cells(const Observation& observation, const Box& workspace, int stride, int count,
                                  const PixelPlaces* places = nullptr);

}  // namespace flowscope
