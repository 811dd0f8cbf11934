// What a ghost (overlay.h) of a robot's own hand looks like.
#pragma once

#include <vector>

#include "render/pose.h"

namespace flowscope {

/// Parts of a hand, placed in the tool frame: origin between the fingertips, z out of the hand, y the axis
/// along which the fingers open. Of the model that a renderer draws: mesh ids are that model's.
struct GripperShape {
  struct Part {
    int type = 0;                        ///< MuJoCo's number of the geom's kind
    int mesh = -1;                       ///< of that kind: its id in the model
    Eigen::Vector3d half_size{0, 0, 0};  ///< metres, as MuJoCo keeps it for the kind
    std::vector<Pose> tool_from_part;    ///< at openness 0 to 1 in even steps; at least two
  };
  std::vector<Part> parts;
};

/// Between the two nearest of a part's poses; openness outside [0, 1] counts as the end that it is beyond.
Pose tool_from_part(const GripperShape::Part& part, double openness);

/// Two plain fingers on a palm, for robots of which nothing is known.
GripperShape plain_gripper();

}  // namespace flowscope
