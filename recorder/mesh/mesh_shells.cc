#include "recorder/mesh/mesh_shells.h"

#include <map>
#include <numeric>

namespace flowscope {
namespace {

/// Triangles that share an edge which no other has.
std::vector<std::size_t> number_shells(const TriangleMesh& mesh) {
  std::vector<std::size_t> parent(mesh.triangles.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::map<std::pair<int, int>, std::vector<std::size_t>> on_edge;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      on_edge[std::minmax(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3])].push_back(i);
  for (const auto& [edge, faces] : on_edge)
    if (faces.size() == 2) parent[root(faces[0])] = root(faces[1]);
  for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = root(i);
  return parent;
}

}  // namespace

std::vector<TriangleMesh> shells_of(const TriangleMesh& mesh, std::size_t most) {
  const std::vector<std::size_t> shell_of = number_shells(mesh);
  std::map<std::size_t, TriangleMesh> shells;
  std::map<std::size_t, std::map<int, int>> corners;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    TriangleMesh& shell = shells[shell_of[i]];
    if (shells.size() > most) return {};
    auto& known = corners[shell_of[i]];
    std::array<int, 3> triangle = mesh.triangles[i];
    for (int& v : triangle) {
      const auto [it, fresh] = known.try_emplace(v, static_cast<int>(shell.vertices.size()));
      if (fresh) shell.vertices.push_back(mesh.vertices[static_cast<std::size_t>(v)]);
      v = it->second;
    }
    shell.triangles.push_back(triangle);
  }
  std::vector<TriangleMesh> result;
  if (shells.size() < 2) return result;
  for (auto& [number, shell] : shells) {
    if (!is_closed(shell) || mass_properties(shell).volume <= 0) return {};
    result.push_back(std::move(shell));
  }
  return result;
}

}  // namespace flowscope
