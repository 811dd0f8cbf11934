// A task read from its folder. The file task.yaml:
//
//   robot: ur5                                   assets/robots/ur5.yaml, or mine.yaml in this folder; panda
//   where it is left out
//   bounds: {min: [x, y, z], max: [x, y, z]}     keyframe box, metres, world
//   keyframes: 6                                 keyframes of the longest demonstration
//   published_keyframes: 5.5                     optional: their mean in the benchmark's demonstrations
//   variations:                                  what each variation binds for {placeholders}
//     combine:                                   every combination; the last entry turns fastest
//       - permutations: {from: colors, choose: 3, take: 17, as: color}      {color_1} {color_2} {color_3},
//       fixed for ever
//       - count: [1, 2, 3]                                                  {count}
//     limit: 50
//   draw:                                        what each episode draws besides
//     - {sample: 2, from: colors, except: ["{color_1}"], as: spare}         {spare_1} {spare_2}, without
//     replacement
//   instructions:                                phrasings; the first is THE instruction. A list is joined
//   without gaps.
//     - ["push the {color_1} button", {repeat: "{count}", from: 2, each: [", then push the {color_{i}}
//     button"]}]
//   colors:                                      materials, in order; later lines win
//     - {material: button_1_cap, color: "{color_1}"}
//   placement: …                                 task_placement.h; may hold what is bound and drawn
//   success: …                                   success.h
//   demonstration: [steps of a waypoint script]  script.h
//
// `colors` as a list of words means the benchmark's 20. Any list may hold {repeat: N, from: 1, each: […]}
// with {i}. Everything is checked for every variation when the task is read. What the gripper can take are
// the bodies that a weld equality in scene.xml ties to the body `hand`.
#pragma once

#include <filesystem>

#include "recorder/task.h"

namespace flowscope {

/// Compiles <folder>/scene.xml and reads <folder>/task.yaml. The scene may include the files of
/// <assets>/robots and <assets>/scenes by their bare names. Throws BadScript or std::runtime_error that name
/// the place.
std::shared_ptr<const Task> load_task(const std::filesystem::path& folder,
                                      const std::filesystem::path& assets);

}  // namespace flowscope
