#include "policy/symmetric_yaw.h"

#include <numbers>

namespace flowscope {
namespace {

// The angle has no derivative where the moment vanishes: the same value with a derivative held back there.
torch::Tensor safe_angle(const torch::Tensor& re, const torch::Tensor& im) {
  const torch::Tensor re0 = re.detach(), im0 = im.detach();
  const torch::Tensor change = (re0 * im - im0 * re) / (re0 * re0 + im0 * im0 + 0.02);
  return torch::atan2(im0, re0) + change - change.detach();
}

torch::Tensor nearest_to_tool(torch::Tensor angle, const torch::Tensor& tool_x, double period) {
  const torch::Tensor tool = torch::atan2(tool_x.select(-1, 1), tool_x.select(-1, 0)).unsqueeze(1);
  angle = angle + period * torch::round((tool - angle.detach()) / period);
  return torch::stack({angle.cos(), angle.sin(), torch::zeros_like(angle)}, -1);
}

}  // namespace

torch::Tensor symmetric_yaw(const torch::Tensor& moment, const torch::Tensor& tool_x, int n, double offset) {
  const torch::Tensor angle = safe_angle(moment.select(-1, 0), moment.select(-1, 1)) / n + offset;
  return nearest_to_tool(angle, tool_x, 2 * std::numbers::pi / n);
}

torch::Tensor nearest_quarter(const torch::Tensor& direction, const torch::Tensor& tool_x) {
  return nearest_to_tool(safe_angle(direction.select(-1, 0), direction.select(-1, 1)), tool_x,
                         std::numbers::pi / 2);
}

}  // namespace flowscope
