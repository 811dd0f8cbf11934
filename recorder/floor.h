// A floor that is there to be seen only lets what falls off the table fall for ever.
#pragma once

#include <vector>

struct mjModel_;
struct mjData_;

namespace flowscope {

/// Every level plane that touches nothing, and that everything which can touch stands above, stops loose
/// bodies: those that no joint holds. They meet it through a bit of their own, so that arms and fixtures are
/// never compared with it, and only while one of them is near: it costs nothing before. Holds indices only.
class Floor {
 public:
  Floor() = default;
  /// Gives the loose bodies of `model` their bit.
  explicit Floor(mjModel_* model);
  /// Before every frame, with geoms placed: the floor is there for this frame, or not. What it does follows
  /// from where things are alone, so that the same states go on in the same way.
  void watch(mjModel_* model, const mjData_* data) const;

 private:
  int bit_ = 0;
  std::vector<int> planes_, loose_;  ///< geoms
};

}  // namespace flowscope
