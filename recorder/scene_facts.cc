#include "recorder/scene_facts.h"

#include <fcntl.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

namespace flowscope {
namespace {

int coordinates(int joint_type) {
  if (joint_type == mjJNT_FREE) return 7;
  return joint_type == mjJNT_BALL ? 4 : 1;
}

/// MuJoCo writes its text into files only. This one is a pipe: it needs no room on a disk.
class TextPipe {
 public:
  TextPipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
      throw std::system_error(errno, std::generic_category(), "no pipe for a scene's text");
    in_ = ends[1];
    reader_ = std::thread([this, out = ends[0]] {
      std::array<char, 1 << 16> part{};
      for (ssize_t count = 1; count > 0 || (count < 0 && errno == EINTR);) {
        count = ::read(out, part.data(), part.size());
        if (count > 0) text_.append(part.data(), static_cast<std::size_t>(count));
      }
      ::close(out);
    });
  }
  ~TextPipe() { close(); }
  TextPipe(const TextPipe&) = delete;
  TextPipe& operator=(const TextPipe&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(in_); }
  /// All that was written, once nobody else holds it open.
  std::string text() {
    close();
    return std::move(text_);
  }

 private:
  void close() {
    if (in_ >= 0) ::close(std::exchange(in_, -1));
    if (reader_.joinable()) reader_.join();
  }

  int in_ = -1;
  std::string text_;
  std::thread reader_;
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
  TextPipe pipe;
  std::array<char, 1000> error{};
  if (mj_saveLastXML(pipe.path().c_str(), model, error.data(), static_cast<int>(error.size())) == 0) {
    throw std::runtime_error(std::string("the scene cannot be written as MJCF: ") + error.data());
  }
  return pipe.text();
}

}  // namespace flowscope
