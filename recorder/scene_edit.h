// What a scene that was not written for flowscope lacks, added to its MJCF.
#pragma once

#include <filesystem>
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

/// A URDF with its visual shapes and massless frames kept, unless it says otherwise itself. Its meshes are
/// looked for where it names them, from `folder`, or for package:// from there upwards; when one of them is
/// not there, all are left to MuJoCo, which looks beside the file.
std::string opened_urdf(const std::string& urdf, const std::filesystem::path& folder);

}  // namespace flowscope
