// The success vocabulary of task.yaml.
//
//   joint:    {joint: J, beyond: 0.15}          moved more than that (m or rad) since the episode began
//   pressed:  {joint: J, travel: 0.001}         the same, for buttons; may show it: material: M, color: W
//   inside:   {body: B, sensor: SITE}           any part of the body lies in the box of the site
//   near:     {frame: F, to: G, within: 0.01}   two bodies or sites, metres between their origins
//   grasped:  B                                 welded to the gripper
//   released: B | any                           not (or nothing at all) welded to the gripper
//   all: […]  any: […]  in_order: […]           in_order latches each term as it becomes true
#pragma once

#include <memory>

#include "recorder/task.h"
#include "recorder/task_tree.h"

namespace flowscope {

/// `node` is a filled `success:` tree. Throws BadScript that names the place for unknown words, joints,
/// bodies and sites. `data` holds the moment that joints are measured from.
std::unique_ptr<SuccessCheck> make_success(const TaskReader& reader, const TaskNode& node,
                                           const mjModel_* model, const mjData_* data);

}  // namespace flowscope
