#include "recorder/scene_files.h"

#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <stdexcept>

#include "recorder/scene_trouble.h"
#include "render/mujoco_guard.h"

namespace flowscope {
namespace {

bool add_to(mjVFS* files, const std::string& name, const std::string& text) {
  if (mj_makeEmptyFileVFS(files, name.c_str(), static_cast<int>(text.size())) != 0) return false;
  std::memcpy(files->filedata[mj_findFileVFS(files, name.c_str())], text.data(), text.size());
  return true;
}

/// In place of one of that name. (mj_deleteFileVFS of MuJoCo 2.2.2 leaves a table in which searches never
/// end.)
void put_into(mjVFS* files, const std::string& name, const std::string& text) {
  if (const int old = mj_findFileVFS(files, name.c_str()); old >= 0) {
    mju_free(files->filedata[old]);
    files->filedata[old] = mju_malloc(text.size());
    files->filesize[old] = static_cast<int>(text.size());
    std::memcpy(files->filedata[old], text.data(), text.size());
  } else if (!add_to(files, name, text)) {
    throw std::runtime_error(name + ": too many files for one scene");
  }
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
      shared_[entry.path().filename().string()] = entry.path();
    }
  }
}

SceneFiles::~SceneFiles() { mj_deleteVFS(files_.get()); }

bool SceneFiles::add(const std::string& name, const std::string& text) {
  return add_to(files_.get(), name, text);
}

ModelPtr SceneFiles::compile(const std::filesystem::path& file) const {
  add_objects(file, files_.get());
  std::string unread;
  try {
    const SceneSource text = source(file);
    prefer_own(text);
    unread = text.unread;
  } catch (const std::runtime_error&) {
    // told when MuJoCo cannot read it either
  }
  Loaded loaded = load(file);
  if (!loaded.model) throw trouble(file, loaded.message);
  if (!unread.empty()) throw SceneError(unread);
  return std::move(loaded.model);
}

ModelPtr SceneFiles::compile(const PlacedText& text, const SceneSource& source) const {
  add_objects(source.files.at(0), files_.get());
  Loaded loaded = load(text.text, source.folder());
  if (!loaded.model) throw scene_trouble(loaded.message, source, text.lines);
  return std::move(loaded.model);
}

SceneSource SceneFiles::source(const std::filesystem::path& scene) const {
  return read_source(
      scene, [this](const std::string& name) -> std::optional<std::pair<std::filesystem::path, std::string>> {
        const auto found = shared_.find(name);
        if (found == shared_.end()) return std::nullopt;
        return std::pair{found->second, read_text(found->second)};
      });
}

/// MuJoCo would take a shared file in place of one that a scene has itself under that name.
void SceneFiles::prefer_own(const SceneSource& source) const {
  for (const auto& file : source.files) {
    const auto shared = shared_.find(file.filename().string());
    std::error_code none;
    if (shared != shared_.end() && !std::filesystem::equivalent(file, shared->second, none))
      put_into(files_.get(), shared->first, read_text(file));
  }
}

SceneFiles::Loaded SceneFiles::load(const std::filesystem::path& file) const {
  install_mujoco_guard();
  std::array<char, 1000> error{};
  ModelPtr model(mj_loadXML(file.c_str(), files_.get(), error.data(), static_cast<int>(error.size())));
  return {std::move(model), error.data()};
}

SceneFiles::Loaded SceneFiles::load(const std::string& text, const std::filesystem::path& folder) const {
  const std::string name = "flowscope-written.xml";
  put_into(files_.get(), name, text);
  return load(folder / name);
}

/// MuJoCo knows no lines of included files: the same is loaded again as one text.
SceneError SceneFiles::trouble(const std::filesystem::path& file, const std::string& message) const {
  SceneSource text;
  try {
    text = source(file);
  } catch (const SceneError& error) {
    return error;
  }
  const auto is_shared = [this](const std::string& name) {
    return mj_findFileVFS(files_.get(), name.c_str()) >= 0;
  };
  if (const std::string missing = missing_files(text, is_shared); !missing.empty())
    return SceneError(missing);
  const PlacedText whole = to_placed_text(text.root);
  const Loaded again = load(whole.text, text.folder());
  if (again.model) return scene_trouble(message, text, {});
  return scene_trouble(again.message, text, whole.lines);
}

}  // namespace flowscope
