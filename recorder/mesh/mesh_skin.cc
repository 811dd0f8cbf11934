#include "recorder/mesh/mesh_skin.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "render/decode.h"

namespace flowscope {
namespace {

using Color = std::array<std::uint8_t, 3>;

constexpr std::size_t kMost_colors = 4096;
constexpr int kPalette_px = 256, kCell_px = 1024, kSkin_px = 4096;
constexpr int kRim_px = 4;  ///< of a cell, continued from inside: the simulator blurs from afar
constexpr int kMost_repeats = 4;

/// Distinct colours; with too many of them their last bits go first.
std::map<Color, int> number_colors(std::vector<Color>& colors) {
  for (int bits = 8;; --bits) {
    std::map<Color, int> numbers;
    const int keep = 0xFF << (8 - bits) & 0xFF, middle = bits == 8 ? 0 : 1 << (7 - bits);
    for (Color& color : colors) {
      for (auto& c : color) c = static_cast<std::uint8_t>((c & keep) | middle);
      numbers.try_emplace(color, 0);
    }
    if (numbers.size() > kMost_colors) continue;
    int next = 0;
    for (auto& [color, number] : numbers) number = next++;
    return numbers;
  }
}

/// Square cells, row by row; large ones, for the simulator draws a texture from afar blurred.
class Palette {
 public:
  explicit Palette(const std::map<Color, int>& numbers)
      : cells_(static_cast<int>(std::ceil(std::sqrt(static_cast<double>(numbers.size()))))),
        image_(kPalette_px, kPalette_px) {
    std::vector<Color> colors(static_cast<std::size_t>(cells_ * cells_), numbers.rbegin()->first);
    for (const auto& [color, number] : numbers) colors[static_cast<std::size_t>(number)] = color;
    for (int y = 0; y < kPalette_px; ++y)
      for (int x = 0; x < kPalette_px; ++x) {
        const int cell = y * cells_ / kPalette_px * cells_ + x * cells_ / kPalette_px;
        std::copy_n(colors[static_cast<std::size_t>(cell)].begin(), 3, image_.at(x, y));
      }
  }
  /// A triangle inside the colour's cell, all of it at one point.
  TextureCorners middle(int number) const {
    const Eigen::Vector2d at((number % cells_ + 0.5) / cells_, 1 - (number / cells_ + 0.5) / cells_);
    return {at.cast<float>(), at.cast<float>(), at.cast<float>()};
  }
  const ImageRgb& image() const { return image_; }

 private:
  int cells_;
  ImageRgb image_;
};

Color mean_of(const ImageRgb& image) {
  const ImageRgb one = resized(image, 1, 1);
  return {one.data[0], one.data[1], one.data[2]};
}

/// Moved by whole repeats to where none of it lies below 0.
TextureCorners from_zero(TextureCorners corners) {
  Eigen::Vector2f low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]).array().floor();
  for (auto& corner : corners) corner -= low;
  return corners;
}

int repeats_of(const TextureCorners& corners) {
  const float most = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]).maxCoeff();
  return std::max(1, static_cast<int>(std::ceil(most - 1e-4f)));
}

/// What each triangle is painted with. Plain: `texture` is -1 and `color` holds.
struct Paint {
  int texture = -1;
  Color color{};
  TextureCorners corners{};
};

std::vector<Paint> paint_of(const TriangleMesh& mesh) {
  std::vector<Paint> paint(mesh.triangles.size());
  for (std::size_t i = 0; i < paint.size(); ++i) {
    if (!mesh.colors.empty()) paint[i].color = mesh.colors[i];
    if (mesh.texture_of.empty() || mesh.texture_of[i] < 0) continue;
    paint[i].texture = mesh.texture_of[i];
    paint[i].corners = mesh.texture_corners[i];
  }
  return paint;
}

/// Pictures in a square of cells.
class Cells {
 public:
  explicit Cells(std::size_t count)
      : columns_(std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count)))))),
        side_(std::min(kCell_px, kSkin_px / columns_)),
        image_(columns_ * side_, columns_ * side_) {}

  /// Draws the next one, `repeats` times along each side.
  int add(const ImageRgb& picture, int repeats) {
    const int inner = side_ - 2 * kRim_px;
    const ImageRgb once = resized(picture, std::max(1, inner / repeats), std::max(1, inner / repeats));
    const auto source = [&](int at) {
      const double place = (at - kRim_px + 0.5) / inner * repeats;
      const double in_one = repeats > 1 ? place - std::floor(place) : std::clamp(place, 0.0, 1.0);
      return std::min(once.width - 1, static_cast<int>(in_one * once.width));
    };
    for (int y = 0; y < side_; ++y)
      for (int x = 0; x < side_; ++x)
        std::copy_n(once.at(source(x), source(y)), 3,
                    image_.at(next_ % columns_ * side_ + x, next_ / columns_ * side_ + y));
    repeats_.push_back(repeats);
    return next_++;
  }
  TextureCorners place(int cell, TextureCorners corners) const {
    const float inner = static_cast<float>(side_ - 2 * kRim_px), all = static_cast<float>(image_.width);
    const int repeats = repeats_[static_cast<std::size_t>(cell)];
    for (auto& corner : corners) {
      const float left = static_cast<float>(cell % columns_ * side_ + kRim_px);
      const float top = static_cast<float>(cell / columns_ * side_ + kRim_px);
      // The picture's lower left corner is that of the lowest repeat.
      corner = {(left + inner * corner.x() / static_cast<float>(repeats)) / all,
                1 - (top + inner * (1 - corner.y() / static_cast<float>(repeats))) / all};
    }
    return corners;
  }
  ImageRgb take() { return std::move(image_); }

 private:
  int columns_, side_, next_ = 0;
  std::vector<int> repeats_;
  ImageRgb image_;
};

}  // namespace

MeshSkin skin_of(const TriangleMesh& mesh) {
  MeshSkin skin;
  std::vector<Paint> paint = paint_of(mesh);
  std::map<int, int> repeats;  // of each texture that is seen
  const auto textured = [](const Paint& p) { return p.texture >= 0; };
  for (const Paint& p : paint)
    if (textured(p)) repeats.try_emplace(p.texture, 1);
  if (repeats.size() == 1 && std::ranges::all_of(paint, textured)) {
    skin.picture = mesh.textures[static_cast<std::size_t>(repeats.begin()->first)];
    for (const Paint& p : paint) skin.corners.push_back(p.corners);
    skin.textures = 1;
    return skin;
  }
  for (Paint& p : paint) {
    if (!textured(p)) continue;
    p.corners = from_zero(p.corners);
    const int wanted = repeats_of(p.corners);
    if (wanted > kMost_repeats) {
      p = {-1, mean_of(mesh.textures[static_cast<std::size_t>(p.texture)]), {}};
    } else {
      repeats[p.texture] = std::max(repeats[p.texture], wanted);
    }
  }
  std::erase_if(repeats, [&](const auto& one) {
    return std::ranges::none_of(paint, [&](const Paint& p) { return p.texture == one.first; });
  });
  std::vector<Color> colors;
  for (const Paint& p : paint)
    if (!textured(p)) colors.push_back(p.color);
  const std::map<Color, int> numbers = number_colors(colors);
  skin.textures = repeats.size();
  skin.colors = numbers.size();
  if (repeats.empty() && numbers.size() < 2) return skin;

  std::optional<Palette> palette;
  if (!numbers.empty()) palette.emplace(numbers);
  std::size_t plain = 0;  // those before
  if (repeats.empty()) {
    skin.picture = palette->image();
    for (const Color& color : colors) skin.corners.push_back(palette->middle(numbers.at(color)));
    return skin;
  }
  Cells cells(repeats.size() + (palette ? 1 : 0));
  std::map<int, int> cell_of;
  for (const auto& [texture, times] : repeats)
    cell_of[texture] = cells.add(mesh.textures[static_cast<std::size_t>(texture)], times);
  const int palette_cell = palette ? cells.add(palette->image(), 1) : -1;
  for (const Paint& p : paint) {
    skin.corners.push_back(textured(p)
                               ? cells.place(cell_of.at(p.texture), p.corners)
                               : cells.place(palette_cell, palette->middle(numbers.at(colors[plain++]))));
  }
  skin.picture = cells.take();
  return skin;
}

}  // namespace flowscope
