#include "recorder/mesh/mesh_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "recorder/mesh/mesh_skin.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

constexpr double kSmooth = 0.766;  ///< cosine of 40 degrees

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

}  // namespace

MeshPicture picture_of(const TriangleMesh& mesh) {
  MeshPicture picture;
  MeshSkin skin = skin_of(mesh);
  picture.colors = skin.colors;
  picture.textures = skin.textures;
  const bool painted = !skin.corners.empty();

  const std::vector<Vector3d> normals = face_normals(mesh);
  std::vector<std::vector<std::size_t>> around(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const int corner : mesh.triangles[i]) around[static_cast<std::size_t>(corner)].push_back(i);
  std::string vertices, textures, shading, faces;
  int written = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vector3d own = normals[i].normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto corner = static_cast<std::size_t>(mesh.triangles[i][k]);
      const Vector3d& at = mesh.vertices[corner];
      Vector3d normal = Vector3d::Zero();
      for (const std::size_t other : around[corner])
        if (normals[other].normalized().dot(own) > kSmooth) normal += normals[other];
      normal = normal.norm() > 0 ? normal.normalized() : own;
      append(vertices, "v %.7g %.7g %.7g\n", at.x(), at.y(), at.z());
      append(shading, "vn %.5f %.5f %.5f\n", normal.x(), normal.y(), normal.z());
      if (painted) {
        char line[64];
        std::snprintf(line, sizeof line, "vt %.6f %.6f\n", skin.corners[i][k].x(), skin.corners[i][k].y());
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
  picture.skin = std::move(skin.picture);
  return picture;
}

std::string plain_obj(const TriangleMesh& mesh) {
  std::string text;
  for (const Vector3d& v : mesh.vertices) append(text, "v %.7g %.7g %.7g\n", v.x(), v.y(), v.z());
  for (const auto& t : mesh.triangles) append(text, "f %.0f %.0f %.0f\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

}  // namespace flowscope
