#include "recorder/scene_files.h"

#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "render/mujoco_guard.h"

namespace flowscope {
namespace {

bool add_to(mjVFS* files, const std::string& name, const std::string& text) {
  if (mj_makeEmptyFileVFS(files, name.c_str(), static_cast<int>(text.size())) != 0) return false;
  std::memcpy(files->filedata[mj_findFileVFS(files, name.c_str())], text.data(), text.size());
  return true;
}

/// Objects in folders of their own beside the scene (mug/mug.xml): the simulator would look for their meshes
/// and pictures beside the scene itself.
void add_objects(const std::filesystem::path& scene, mjVFS* files) {
  const auto folder = scene.has_parent_path() ? scene.parent_path() : std::filesystem::path(".");
  std::error_code none;
  for (const auto& object : std::filesystem::directory_iterator(folder, none)) {
    const std::string name = object.path().filename().string();
    if (!object.is_directory() || !std::filesystem::exists(object.path() / (name + ".xml"))) continue;
    for (const auto& part : std::filesystem::directory_iterator(object.path())) {
      const std::string ending = part.path().extension().string(), file = part.path().filename().string();
      if ((ending != ".obj" && ending != ".png") || mj_findFileVFS(files, file.c_str()) >= 0) continue;
      if (!add_to(files, file, read_text(part.path())))
        throw std::runtime_error(part.path().string() + ": too many files for one scene");
    }
  }
}

}  // namespace

SceneFiles::SceneFiles(const std::filesystem::path& assets) : files_(std::make_unique<mjVFS>()) {
  mj_defaultVFS(files_.get());
  for (const char* folder : {"robots", "scenes"}) {
    if (!std::filesystem::is_directory(assets / folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(assets / folder)) {
      if (entry.path().extension() != ".xml") continue;
      if (!add(entry.path().filename().string(), read_text(entry.path()))) {
        throw std::runtime_error(entry.path().string() + ": its name is taken by another shared scene file");
      }
    }
  }
}

SceneFiles::~SceneFiles() { mj_deleteVFS(files_.get()); }

bool SceneFiles::add(const std::string& name, const std::string& text) {
  return add_to(files_.get(), name, text);
}

ModelPtr SceneFiles::compile(const std::filesystem::path& file) const {
  install_mujoco_guard();
  add_objects(file, files_.get());
  std::array<char, 1000> error{};
  ModelPtr model(mj_loadXML(file.c_str(), files_.get(), error.data(), static_cast<int>(error.size())));
  if (!model) throw std::runtime_error(file.string() + ": " + error.data());
  return model;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file.string() + ": can not be read");
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace flowscope
