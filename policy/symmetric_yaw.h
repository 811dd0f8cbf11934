// The yaw of something that looks the same after a turn by 360°/n.
#pragma once

#include "policy/torch_parts.h"

namespace flowscope {

/// θ = arg(m) / n + offset for a horizontal moment m of order n: n = 4 for squares, 2 for bars. Of its n
/// equal values the one nearest to the yaw of the tool's x axis is taken, as an expert who turns as little as
/// possible does. moment [B, H, 2], tool_x [B, 3] -> horizontal unit vectors [B, H, 3].
torch::Tensor symmetric_yaw(const torch::Tensor& moment, const torch::Tensor& tool_x, int n, double offset);

/// The same for a direction known only up to quarter turns: direction [B, H, 3] -> [B, H, 3].
torch::Tensor nearest_quarter(const torch::Tensor& direction, const torch::Tensor& tool_x);

}  // namespace flowscope
