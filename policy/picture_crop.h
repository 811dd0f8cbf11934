// The paper's augmentation: pictures and the places of their pixels resized and cropped together.
#pragma once

#include <vector>

#include "policy/random.h"
#include "policy/scene_points.h"

namespace flowscope {

/// The window that is seen of a picture enlarged by `scale` (nearest pixel); beyond its edges the picture is
/// mirrored (the edge pixel is not repeated). `left` and `top` count enlarged pixels and may be negative.
struct PictureCrop {
  double scale = 1;
  int left = 0, top = 0;
};

/// Scale uniform in 0.75 … 1.25, as the method's published code has it, and a window anywhere: inside an
/// enlarged picture, around a reduced one.
PictureCrop random_crop(int width, int height, Random& random);

/// For each pixel of the window, row by row, the pixel of the picture that it shows: y * width + x.
std::vector<int> source_pixels(int width, int height, const PictureCrop& crop);

/// An observation whose pixels stand elsewhere than their camera says. `world[v][y * width + x]` is what
/// pixel (x, y) of view v shows, metres, world; (0, 0, 0) where its depth is 0.
struct ResampledObservation {
  Observation observation;
  PixelPlaces world;
};

/// Colour, depth and place of each pixel together; every view is as large as before and through the same
/// window. The cameras stay those of the whole pictures. Throws std::invalid_argument for a view whose
/// pictures and camera differ in size, or for views of different sizes.
ResampledObservation resample(const Observation& observation, const PictureCrop& crop);

}  // namespace flowscope
