// The yaw of something that looks the same after a turn by 360°/n, read off weighted points.
#pragma once

#include <torch/torch.h>

namespace flowscope {

/// θ = arg(Σ_i w_i z_i^n / |z_i|^(n-2)) / n + offset, z_i the point's horizontal place relative to `center`
/// as a complex number: n = 4 for squares, 2 for bars. Of its n equal values the one nearest to the yaw of
/// the tool's x axis is taken, as an expert who turns as little as possible does. weights [B, H, P], position
/// [B, P, 3], center [B, H, 3], tool_x [B, 3] -> horizontal unit vectors [B, H, 3].
torch::Tensor symmetric_yaw(const torch::Tensor& weights, const torch::Tensor& position,
                            const torch::Tensor& center, const torch::Tensor& tool_x, int n, double offset);

}  // namespace flowscope
