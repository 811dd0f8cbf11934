#include "recorder/mesh_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

namespace flowscope {
namespace {

using Eigen::Vector3d;
using Color = std::array<std::uint8_t, 3>;

constexpr double kSmooth = 0.766;  ///< cosine of 40 degrees
constexpr std::size_t kMost_colors = 4096;
constexpr int kPalette_px = 256;

void append(std::string& text, const char* format, double a, double b, double c) {
  char line[96];
  std::snprintf(line, sizeof line, format, a, b, c);
  text += line;
}

std::vector<Vector3d> face_normals(const TriangleMesh& mesh) {
  std::vector<Vector3d> normals;
  for (const auto& t : mesh.triangles) {
    const auto at = [&](std::size_t k) -> const Vector3d& {
      return mesh.vertices[static_cast<std::size_t>(t[k])];
    };
    normals.push_back((at(1) - at(0)).cross(at(2) - at(0)));  // as long as the face is large
  }
  return normals;
}

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
  /// u to the right, v downwards, both 0 … 1.
  std::array<double, 2> middle(int number) const {
    return {(number % cells_ + 0.5) / cells_, (number / cells_ + 0.5) / cells_};
  }
  const ImageRgb& image() const { return image_; }

 private:
  int cells_;
  ImageRgb image_;
};

}  // namespace

MeshPicture picture_of(const TriangleMesh& mesh) {
  MeshPicture picture;
  std::vector<Color> colors = mesh.colors;
  const std::map<Color, int> numbers = number_colors(colors);
  picture.colors = std::max<std::size_t>(1, numbers.size());
  const bool painted = numbers.size() > 1;
  std::optional<Palette> palette;
  if (painted) picture.palette = palette.emplace(numbers).image();

  const std::vector<Vector3d> normals = face_normals(mesh);
  std::vector<std::vector<std::size_t>> around(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const int corner : mesh.triangles[i]) around[static_cast<std::size_t>(corner)].push_back(i);
  std::string vertices, textures, shading, faces;
  int written = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vector3d own = normals[i].normalized();
    for (const int corner : mesh.triangles[i]) {
      const Vector3d& at = mesh.vertices[static_cast<std::size_t>(corner)];
      Vector3d normal = Vector3d::Zero();
      for (const std::size_t other : around[static_cast<std::size_t>(corner)])
        if (normals[other].normalized().dot(own) > kSmooth) normal += normals[other];
      normal = normal.norm() > 0 ? normal.normalized() : own;
      append(vertices, "v %.7g %.7g %.7g\n", at.x(), at.y(), at.z());
      append(shading, "vn %.5f %.5f %.5f\n", normal.x(), normal.y(), normal.z());
      if (painted) {
        // OBJ counts from the bottom of the picture.
        const auto [u, v] = palette->middle(numbers.at(colors[i]));
        char line[64];
        std::snprintf(line, sizeof line, "vt %.6f %.6f\n", u, 1 - v);
        textures += line;
      }
    }
    faces += 'f';
    for (int k = 0; k < 3; ++k) {
      const std::string number = std::to_string(++written);
      faces += ' ' + number + '/' + (painted ? number : "") + '/' + number;
    }
    faces += '\n';
  }
  picture.obj = vertices + textures + shading + faces;
  return picture;
}

std::string plain_obj(const TriangleMesh& mesh) {
  std::string text;
  for (const Vector3d& v : mesh.vertices) append(text, "v %.7g %.7g %.7g\n", v.x(), v.y(), v.z());
  for (const auto& t : mesh.triangles) append(text, "f %.0f %.0f %.0f\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

}  // namespace flowscope
