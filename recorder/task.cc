#include "recorder/task.h"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include "recorder/task_folder.h"

namespace flowscope {
namespace {

bool is_task_folder(const std::filesystem::path& path) {
  return std::filesystem::is_regular_file(path / "task.yaml") &&
         std::filesystem::is_regular_file(path / "scene.xml");
}

}  // namespace

DemoOrigin Task::origin() const { return {robot().name, static_cast<int>(robot().joints.size()), {}}; }

TaskLibrary::TaskLibrary(std::filesystem::path assets, std::vector<std::filesystem::path> extra)
    : assets_(std::move(assets)) {
  extra.insert(extra.begin(), assets_ / "tasks");
  for (const auto& root : extra) {
    if (!std::filesystem::is_directory(root))
      throw std::runtime_error(root.string() + ": no such folder of tasks");
    for (const auto& entry : std::filesystem::directory_iterator(root)) {
      if (is_task_folder(entry.path())) folders_[entry.path().filename().string()] = entry.path();
    }
  }
  if (folders_.empty()) throw std::runtime_error((assets_ / "tasks").string() + ": holds no task");
}

std::vector<std::string> TaskLibrary::names() const {
  std::vector<std::string> result;
  for (const auto& [name, folder] : folders_) result.push_back(name);
  return result;
}

void TaskLibrary::add(std::shared_ptr<const Task> task) {
  const std::string name = task->name();
  if (!folders_.emplace(name, std::filesystem::path()).second) {
    throw std::invalid_argument("a task is called '" + name +
                                "' already: give the scene's file another name");
  }
  const std::lock_guard lock(mutex_);
  loaded_[name] = std::move(task);
}

std::shared_ptr<const Task> TaskLibrary::get(const std::string& name) const {
  const auto folder = folders_.find(name);
  if (folder == folders_.end()) {
    std::string known;
    for (const auto& [other, path] : folders_) known += (known.empty() ? "" : ", ") + other;
    throw std::invalid_argument("no task is called '" + name + "' (known: " + known + ")");
  }
  const std::lock_guard lock(mutex_);
  auto& task = loaded_[name];
  if (!task) task = load_task(folder->second, assets_);
  return task;
}

std::filesystem::path find_assets() {
  const auto is_assets = [](const std::filesystem::path& path) {
    return std::filesystem::is_directory(path / "tasks") && std::filesystem::is_directory(path / "robots");
  };
  if (const char* named = std::getenv("FLOWSCOPE_ASSETS"); named && *named) {
    if (is_assets(named)) return named;
    throw std::runtime_error(std::string("FLOWSCOPE_ASSETS: ") + named + " holds no tasks/ and robots/");
  }
  std::error_code error;
  std::vector<std::filesystem::path> candidates{FLOWSCOPE_SOURCE_ASSETS};
  if (const auto program = std::filesystem::read_symlink("/proc/self/exe", error); !error) {
    candidates.push_back(program.parent_path() / "assets");
    candidates.push_back(program.parent_path() / ".." / "share" / "flowscope" / "assets");
  }
  const auto found = std::find_if(candidates.begin(), candidates.end(), is_assets);
  if (found == candidates.end()) {
    throw std::runtime_error("the assets folder is missing: set FLOWSCOPE_ASSETS to where it lies");
  }
  return std::filesystem::weakly_canonical(*found);
}

}  // namespace flowscope
