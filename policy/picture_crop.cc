#include "policy/picture_crop.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flowscope {
namespace {

constexpr double smallest_scale = 0.75, largest_scale = 1.25;

int resized(int side, double scale) { return std::max(1, static_cast<int>(std::lround(side * scale))); }

/// Anywhere between the window at one end of the picture and at the other.
int random_offset(int side, double scale, Random& random) {
  const int spare = resized(side, scale) - side;
  return std::min(0, spare) + random.below(std::abs(spare) + 1);
}

/// Reflection about the first and the last of `count` pixels, as often as it takes.
int mirrored(int at, int count) {
  if (count == 1) return 0;
  const int period = 2 * (count - 1);
  const int within = ((at % period) + period) % period;
  return within < count ? within : period - within;
}

/// The picture's pixel behind each pixel of the window, along one side.
std::vector<int> sources_along(int side, double scale, int offset) {
  const int large = resized(side, scale);
  std::vector<int> out(static_cast<std::size_t>(side));
  for (int i = 0; i < side; ++i) {
    const int at = mirrored(i + offset, large);
    out[static_cast<std::size_t>(i)] = std::min(side - 1, static_cast<int>((at + 0.5) * side / large));
  }
  return out;
}

}  // namespace

PictureCrop random_crop(int width, int height, Random& random) {
  PictureCrop crop;
  crop.scale = random.uniform(smallest_scale, largest_scale);
  crop.left = random_offset(width, crop.scale, random);
  crop.top = random_offset(height, crop.scale, random);
  return crop;
}

std::vector<int> source_pixels(int width, int height, const PictureCrop& crop) {
  const std::vector<int> columns = sources_along(width, crop.scale, crop.left),
                         rows = sources_along(height, crop.scale, crop.top);
  std::vector<int> out;
  out.reserve(columns.size() * rows.size());
  for (const int y : rows)
    for (const int x : columns) out.push_back(y * width + x);
  return out;
}

ResampledObservation resample(const Observation& observation, const PictureCrop& crop) {
  ResampledObservation out{observation, {}};
  std::vector<int> source;
  for (std::size_t v = 0; v < observation.views.size(); ++v) {
    const View& whole = observation.views[v];
    const int width = whole.camera.width, height = whole.camera.height;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    if (whole.rgb.data.size() != 3 * pixels || whole.depth.data.size() != pixels)
      throw std::invalid_argument("view '" + whole.camera.name +
                                  "': picture, depth and camera differ in size");
    if (v == 0) source = source_pixels(width, height, crop);
    if (source.size() != pixels)
      throw std::invalid_argument("view '" + whole.camera.name + "' is of another size than the first");
    View& view = out.observation.views[v];
    std::vector<Eigen::Vector3d>& world = out.world.emplace_back(pixels, Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < pixels; ++i) {
      const int x = source[i] % width, y = source[i] / width;
      std::copy_n(whole.rgb.at(x, y), 3, &view.rgb.data[3 * i]);
      const float depth = view.depth.data[i] = whole.depth.at(x, y);
      if (depth > 0) world[i] = whole.camera.unproject(x + 0.5, y + 0.5, depth);
    }
  }
  return out;
}

}  // namespace flowscope
