// What the policy learns from: one keyframe of one demonstration, and its changed copies (augmentation).
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "policy/policy.h"
#include "policy/preset.h"
#include "policy/random.h"
#include "policy/scene_points.h"
#include "policy/words.h"

namespace flowscope {

inline constexpr int history_length = 3;
inline constexpr int keyframe_rows = 32;  ///< later keyframes share the last row

/// The policy's view of the world at one moment, prepared. History: oldest first, padded by repeating the
/// oldest.
struct SceneInput {
  std::shared_ptr<const PreparedScene> scene;
  std::vector<Word> words;
  std::array<RobotState, history_length> history;
  int keyframe_index = 0;
};

struct Sample {
  std::string demo;
  SceneInput input;
  std::vector<std::vector<Word>> phrasings;  ///< of the same instruction; input.words is one of them
  GripperAction target;
};

/// Throws std::invalid_argument for an empty history or a picture that does not fit.
SceneInput prepare_input(const PolicyInput& input, const Box& bounds, const NetworkShape& shape,
                         const Vocabulary& vocabulary);

/// The policy input from which keyframe k of a demonstration is to be predicted.
PolicyInput input_of_keyframe(const Demo& demo, int k);

/// One sample per keyframe. Throws std::invalid_argument naming the demonstration.
std::vector<Sample> samples_of(const Demo& demo, const Box& bounds, const NetworkShape& shape,
                               const Vocabulary& vocabulary);

/// The same keyframe elsewhere: scene, history and target turned about world z and shifted together, colours
/// of points, patches and colour words turned about the grey axis together, points jittered, joints and past
/// poses blurred, things on the table moved about. `center` is the turning point.
Sample augment(const Sample& sample, const TrainRates& rates, const Eigen::Vector3d& center, Random& random);

}  // namespace flowscope
