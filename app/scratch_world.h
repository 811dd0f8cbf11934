// Questions about any moment of a scene, without waiting for the thread that owns the living world.
#pragma once

#include <memory>
#include <mutex>
#include <type_traits>

#include "recorder/world.h"

namespace flowscope {

/// A world of its own that is put into whatever moment is asked about. Any thread; one question at a time.
class ScratchWorld {
 public:
  explicit ScratchWorld(const TaskLibrary& tasks) : tasks_(tasks) {}

  /// `question(const World&)` at that moment.
  template <class Question>
  std::invoke_result_t<Question, const World&> at(const SceneState& state, Question question) {
    std::lock_guard lock(mutex_);
    if (!world_ || world_->task().name() != state.scene)
      world_ = std::make_unique<World>(tasks_.get(state.scene));
    world_->restore(state);
    return question(*world_);
  }

 private:
  const TaskLibrary& tasks_;
  std::mutex mutex_;
  std::unique_ptr<World> world_;
};

}  // namespace flowscope
