// What the policy learns from: one keyframe of one demonstration, and its changed copies (augmentation).
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "policy/augmentation.h"
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
  std::shared_ptr<const Observation> observation;  ///< as recorded, kept only where its pictures are changed
};

/// Throws std::invalid_argument for an empty history or a picture that does not fit.
SceneInput prepare_input(const PolicyInput& input, const Box& bounds, const NetworkShape& shape,
                         const Vocabulary& vocabulary);

/// The policy input from which keyframe k of a demonstration is to be predicted.
PolicyInput input_of_keyframe(const Demo& demo, int k);

/// One sample per keyframe, with its observation if `keep_observation`. Throws std::invalid_argument naming
/// the demonstration.
std::vector<Sample> samples_of(const Demo& demo, const Box& bounds, const NetworkShape& shape,
                               const Vocabulary& vocabulary, bool keep_observation = false);

/// The same keyframe, changed. `kinds.move`: scene, history and target turned about world z and shifted
/// together, `center` being the turning point; `recolor`: colours of points, patches and colour words turned
/// about the grey axis together; `repaint`: part by part (recolor.h); `shuffle`: things on the table moved
/// about, the target with the thing that it is about. With any of them also another phrasing, jittered
/// points, blurred joints and past poses.
Sample augment(const Sample& sample, const TrainRates& rates, const Eigen::Vector3d& center, Random& random,
               const Augmentation& kinds = {});

/// The same keyframe as a crop of its pictures shows it (picture_crop.h): the scene is prepared again. The
/// sample itself where the crop shows nothing of the workspace. Throws std::invalid_argument when the sample
/// has no observation.
Sample with_cropped_pictures(const Sample& sample, const Box& bounds, const NetworkShape& shape,
                             Random& random);

}  // namespace flowscope
