#include "recorder/scene_facts.h"

#include <mujoco/mujoco.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace flowscope {
namespace {

int coordinates(int joint_type) {
  if (joint_type == mjJNT_FREE) return 7;
  return joint_type == mjJNT_BALL ? 4 : 1;
}

/// A file of its own that goes again: MuJoCo writes its text nowhere else.
class ScratchFile {
 public:
  ScratchFile() : path_((std::filesystem::temp_directory_path() / "flowscope-XXXXXX").string()) {
    const int file = ::mkstemp(path_.data());
    if (file < 0) throw std::runtime_error("cannot make " + path_);
    ::close(file);
  }
  ~ScratchFile() { ::unlink(path_.c_str()); }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

bool is_state_of(const mjModel* model, const SceneState& state) {
  const auto is = [](const auto& values, int count) {
    return values.size() == static_cast<std::size_t>(count);
  };
  return is(state.qpos, model->nq) && is(state.qvel, model->nv) && is(state.ctrl, model->nu) &&
         is(state.mocap_pos, 3 * model->nmocap) && is(state.eq_active, model->neq) &&
         is(state.mat_rgba, 4 * model->nmat);
}

std::vector<double> object_state(const mjModel* model, const std::string& tool, const SceneState& state) {
  const int site = mj_name2id(model, mjOBJ_SITE, tool.c_str());
  const int robot = site < 0 ? -1 : model->body_rootid[model->site_bodyid[site]];
  std::vector<double> values;
  for (int joint = 0; joint < model->njnt; ++joint) {
    if (model->body_rootid[model->jnt_bodyid[joint]] == robot) continue;
    const auto first = state.qpos.begin() + model->jnt_qposadr[joint];
    values.insert(values.end(), first, first + coordinates(model->jnt_type[joint]));
  }
  values.insert(values.end(), state.mocap_pos.begin(), state.mocap_pos.end());
  values.insert(values.end(), state.mocap_quat.begin(), state.mocap_quat.end());
  return values;
}

std::string mjcf_of_last_loaded(const mjModel* model) {
  const ScratchFile file;
  std::array<char, 1000> error{};
  if (mj_saveLastXML(file.path().c_str(), model, error.data(), static_cast<int>(error.size())) == 0) {
    throw std::runtime_error(std::string("the scene cannot be written as MJCF: ") + error.data());
  }
  std::ifstream stream(file.path(), std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace flowscope
