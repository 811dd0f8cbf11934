// Whether anything holds the fingers of a gripper where they should be (gripper_check.h).
#pragma once

namespace flowscope {

struct GripperScene;

/// Each finger is driven or tied by an equality to one that is, as the description says; no joint of the hand
/// is loose, and no actuator holds against those of the fingers. Throws BadScript.
void check_fingers_held(GripperScene& scene);

}  // namespace flowscope
