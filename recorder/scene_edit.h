// What a scene that was not written for flowscope lacks, added to its MJCF.
#pragma once

#include <string>

#include "recorder/robot.h"

struct mjModel_;

namespace flowscope {

/// `xml` is the scene as MuJoCo writes it, `scene` the same compiled. Added are
/// - the cameras and lights of `table` where the scene has none of them, arranged about its centre as there
/// about
///   the table; a camera `wrist` too where there is a robot;
/// - the sites and actuators that `robot` (may be an empty description) brings along;
/// - a weld, switched off, between the hand and everything that can be taken: bodies with a free joint.
/// Throws std::runtime_error that names a body or joint which the scene lacks.
std::string completed_scene(const std::string& xml, const mjModel_* scene, const mjModel_* table,
                            const RobotDescription& robot);

}  // namespace flowscope
