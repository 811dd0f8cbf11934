#include "recorder/mesh/mesh_import.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <set>
#include <string>

#include "recorder/mesh/gltf_mesh.h"
#include "recorder/mesh/mesh_neighbour.h"
#include "recorder/mesh/mesh_texture.h"
#include "recorder/mesh/obj_materials.h"
#include "recorder/mesh/stl_bytes.h"

namespace flowscope {
namespace {

constexpr std::uintmax_t kMost_bytes = 256u << 20;
constexpr std::size_t kMost_triangles = 1'000'000;
constexpr int kMost_levels = 64;
constexpr rlim_t kMost_memory = rlim_t{6} << 30, kMost_seconds = 300;  ///< of the rehearsal

/// A mesh file may name others (materials, buffers); only those in its own folder are opened.
class FolderOnly : public Assimp::DefaultIOSystem {
 public:
  explicit FolderOnly(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return allowed(file, mode) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  bool allowed(const std::filesystem::path& file, const std::string& mode) const {
    return mode.find_first_of("wa+") == std::string::npos && lies_below(folder_, file);
  }
  std::filesystem::path folder_;
};

std::uint8_t byte_of(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

class Reader {
 public:
  /// `now_pictures` is called when the file itself has been read.
  Reader(const std::filesystem::path& file, const MeshImportOptions& options,
         std::function<void()> now_pictures = {})
      : file_(file), options_(options), now_pictures_(std::move(now_pictures)) {
    ending_ = file.extension().string();
    std::ranges::transform(ending_, ending_.begin(), [](unsigned char c) { return std::tolower(c); });
  }

  TriangleMesh read() {
    check_file();
    if (!is_gltf() || !read_gltf2()) read_by_library();
    if (mesh_.triangles.empty()) fail("holds no triangles");
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& why) const { throw BadMesh(file_.string() + ": " + why); }

  std::filesystem::path folder() const { return file_.has_parent_path() ? file_.parent_path() : "."; }
  bool is_gltf() const { return ending_ == ".gltf" || ending_ == ".glb"; }

  void tell(const std::string& what) const {
    if (options_.leave_out) options_.leave_out(file_.string() + ": " + what);
  }

  /// False for a file of version 1.
  bool read_gltf2() {
    try {
      auto mesh = read_gltf(
          file_, [this](const std::string& what) { tell(what); }, now_pictures_);
      if (!mesh) return false;
      mesh_ = std::move(*mesh);
    } catch (const std::exception& error) {
      fail(error.what());
    }
    for (Eigen::Vector3d& v : mesh_.vertices) v = position(v);
    return true;
  }

  const aiScene* open(Assimp::Importer& importer) const {
    constexpr unsigned steps =
        aiProcess_ValidateDataStructure | aiProcess_Triangulate | aiProcess_SortByPType;
    if (ending_ != ".stl") return importer.ReadFile(file_.string(), steps);
    const auto bytes =
        sound_stl(bytes_of(file_, kMost_bytes >> 20), [this](const std::string& what) { tell(what); });
    return importer.ReadFileFromMemory(bytes.data(), bytes.size(), steps, "stl");
  }

  void read_by_library() {
    Assimp::Importer importer;
    importer.SetIOHandler(new FolderOnly(folder()));  // it takes it
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = nullptr;
    try {
      scene = open(importer);
    } catch (const std::exception& error) {
      fail(error.what());
    }
    if (scene == nullptr) fail(importer.GetErrorString());
    if (scene->mRootNode == nullptr || !scene->HasMeshes()) fail("holds no triangles");
    if (ending_ == ".obj")
      obj_materials_ = obj_materials(file_, [this](const std::string& what) { tell(what); });
    if (now_pictures_) now_pictures_();
    TextureStore store(folder());
    textures_.emplace(*scene, store);
    add(*scene, *scene->mRootNode, aiMatrix4x4(), 0);
    textures_.reset();
    mesh_.textures = store.take();
    for (const auto& [name, why] : store.left_out())
      tell("its texture '" + name + "' " + why + "; the material's plain colour is used");
    for (const std::string& what : lost_) tell(what);
  }

  void check_file() const {
    static const std::set<std::string> known{".gltf", ".glb", ".dae", ".obj", ".ply", ".stl"};
    if (!known.contains(ending_)) fail("is no mesh file that can be read (.gltf .glb .dae .obj .ply .stl)");
    std::error_code error;
    if (!std::filesystem::is_regular_file(file_, error)) fail("there is no such file");
    const auto bytes = std::filesystem::file_size(file_, error);
    if (error) fail(error.message());
    if (bytes == 0) fail("is empty");
    if (bytes > kMost_bytes) fail("is larger than 256 MiB");
  }

  void add(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, int level) {
    if (level > kMost_levels) fail("its nodes are nested too deeply");
    const aiMatrix4x4 placed = parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add(scene, *scene.mMeshes[node.mMeshes[i]], placed);
    for (unsigned i = 0; i < node.mNumChildren; ++i) add(scene, *node.mChildren[i], placed, level + 1);
  }

  void add(const aiScene& scene, const aiMesh& part, const aiMatrix4x4& placed) {
    if (!part.HasPositions() || !part.HasFaces()) return;
    if (mesh_.triangles.size() + part.mNumFaces > kMost_triangles)
      fail("has more than 1000000 triangles; make it simpler first");
    const int first = static_cast<int>(mesh_.vertices.size());
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      const aiVector3D at = placed * part.mVertices[i];
      mesh_.vertices.push_back(position({at.x, at.y, at.z}));
    }
    const ObjMaterial* obj = obj_material(scene, part.mMaterialIndex);
    const aiColor4D material = obj != nullptr && obj->color
                                   ? aiColor4D((*obj->color)[0], (*obj->color)[1], (*obj->color)[2], 1)
                                   : color_of(scene, part.mMaterialIndex);
    const MaterialTexture texture = obj != nullptr ? textures_->of(name_of(scene, part.mMaterialIndex), *obj)
                                                   : textures_->of(part.mMaterialIndex);
    const bool textured = texture.index >= 0 && part.HasTextureCoords(texture.channel);
    if (texture.index >= 0 && !textured)
      lost_.insert("its texture '" + texture.name +
                   "' has no place on a part of the mesh without texture coordinates");
    if (textured && texture.moved)
      lost_.insert("its texture '" + texture.name +
                   "' is drawn as it lies: how it is moved or scaled is not applied");
    const bool mirrored = placed.Determinant() < 0;
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
      const aiFace& face = part.mFaces[i];
      if (face.mNumIndices != 3) continue;
      std::array<int, 3> corners{};
      TextureCorners in_texture{Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero()};
      aiColor4D sum(0, 0, 0, 0);
      for (unsigned k = 0; k < 3; ++k) {
        if (face.mIndices[k] >= part.mNumVertices) fail("a triangle names a corner that does not exist");
        corners[k] = first + static_cast<int>(face.mIndices[k]);
        if (textured) {
          const aiVector3D& at = part.mTextureCoords[texture.channel][face.mIndices[k]];
          in_texture[k] =
              place_in_texture(obj != nullptr ? obj->place({at.x, at.y}) : Eigen::Vector2f(at.x, at.y));
        }
        sum += part.HasVertexColors(0) ? part.mColors[0][face.mIndices[k]] : aiColor4D(1, 1, 1, 1);
      }
      if (mirrored) {
        std::swap(corners[1], corners[2]);
        std::swap(in_texture[1], in_texture[2]);
      }
      mesh_.texture_of.push_back(textured ? texture.index : -1);
      mesh_.texture_corners.push_back(in_texture);
      mesh_.triangles.push_back(corners);
      mesh_.colors.push_back(
          {shown(material.r * sum.r / 3), shown(material.g * sum.g / 3), shown(material.b * sum.b / 3)});
    }
  }

  /// glTF's colours are linear light, everybody else's are as shown.
  std::uint8_t shown(double value) const { return byte_of(is_gltf() ? to_srgb(value) : value); }

  Eigen::Vector2f place_in_texture(const Eigen::Vector2f& at) const {
    if (!(at.cwiseAbs().maxCoeff() < 1e4f)) fail("has a corner far outside its texture");
    return at;
  }

  static std::string name_of(const aiScene& scene, unsigned index) {
    aiString name;
    if (index < scene.mNumMaterials) scene.mMaterials[index]->Get(AI_MATKEY_NAME, name);
    return name.C_Str();
  }
  const ObjMaterial* obj_material(const aiScene& scene, unsigned index) const {
    const auto it = obj_materials_.find(name_of(scene, index));
    return it == obj_materials_.end() ? nullptr : &it->second;
  }

  static aiColor4D color_of(const aiScene& scene, unsigned index) {
    aiColor4D color(0.7f, 0.7f, 0.7f, 1);
    if (index >= scene.mNumMaterials) return color;
    const aiMaterial& material = *scene.mMaterials[index];
    if (material.Get("$clr.base", 0, 0, color) == aiReturn_SUCCESS) return color;
    material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
    return color;
  }

  Eigen::Vector3d position(const Eigen::Vector3d& at) const {
    if (!at.allFinite()) fail("has a corner that is not finite");
    const char up = options_.up.value_or(is_gltf() || ending_ == ".dae" ? 'y' : 'z');
    const Eigen::Vector3d p = options_.metres_per_unit * at;
    return up == 'y' ? Eigen::Vector3d(p.x(), -p.z(), p.y()) : p;
  }

  const std::filesystem::path& file_;
  const MeshImportOptions& options_;
  std::function<void()> now_pictures_;
  std::string ending_;
  std::map<std::string, ObjMaterial> obj_materials_;  ///< of an OBJ file
  std::optional<MaterialTextures> textures_;
  std::set<std::string> lost_;
  TriangleMesh mesh_;
};

/// Broken files can crash the library or send it round in circles: a child process goes first, and only what
/// it comes back from is read here.
void rehearse(const std::filesystem::path& file, const MeshImportOptions& options) {
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process to read " + file.string() + " in");
  if (child == 0) {
    // Some broken files never end; good ones take a second for ten megabytes.
    std::error_code none;
    const rlim_t time_s = 3 + std::filesystem::file_size(file, none) / (4u << 20);
    const rlimit memory{kMost_memory, kMost_memory}, seconds{time_s, kMost_seconds}, core{0, 0};
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::setrlimit(RLIMIT_DATA, &memory);
    ::setrlimit(RLIMIT_CPU, &seconds);
    ::setrlimit(RLIMIT_CORE, &core);
    try {
      MeshImportOptions silent = options;
      silent.leave_out = nullptr;
      Reader(file, silent, [] {
        const rlimit more{kMost_seconds, kMost_seconds};  // a large picture takes seconds, and ends
        ::setrlimit(RLIMIT_CPU, &more);
      }).read();
    } catch (...) {  // the same will be thrown, and told, when it is read again
    }
    ::_exit(0);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw BadMesh(file.string() + ": is broken in a way that its reader does not survive");
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& file, const MeshImportOptions& options) {
  rehearse(file, options);
  return Reader(file, options).read();
}

}  // namespace flowscope
