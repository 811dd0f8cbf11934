// The names of a robot's description, looked up in the scene in which it is to move.
#pragma once

#include <string>

#include "recorder/robot.h"

struct mjModel_;

namespace flowscope {

/// Id of the object of this kind (mjOBJ_JOINT, _ACTUATOR, _SITE, _BODY, _GEOM). Throws BadScript at the
/// description's `place` ("joints[1]") when the scene has none of that name, and says which names are near.
int find_named(const mjModel_* model, int type, const std::string& name, const RobotDescription& robot,
               const std::string& place);

/// Its name, or "a nameless joint of forearm".
std::string name_of(const mjModel_* model, int type, int id);

/// A number as people write it: "−0.5".
std::string to_words(double value);

}  // namespace flowscope
