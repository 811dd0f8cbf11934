#include "recorder/scene_files.h"

#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "render/mujoco_guard.h"

namespace flowscope {

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
  if (mj_makeEmptyFileVFS(files_.get(), name.c_str(), static_cast<int>(text.size())) != 0) return false;
  std::memcpy(files_->filedata[mj_findFileVFS(files_.get(), name.c_str())], text.data(), text.size());
  return true;
}

ModelPtr SceneFiles::compile(const std::filesystem::path& file) const {
  install_mujoco_guard();
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
