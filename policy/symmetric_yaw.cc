#include "policy/symmetric_yaw.h"

#include <numbers>

namespace flowscope {

torch::Tensor symmetric_yaw(const torch::Tensor& weights, const torch::Tensor& position,
                            const torch::Tensor& center, const torch::Tensor& tool_x, int n, double offset) {
  // Expanding (q - c)^n needs only the moments; here n is at most 4 and P small, so the powers are formed
  // directly.
  const torch::Tensor relative = position.unsqueeze(1) - center.unsqueeze(2);  // [B, H, P, 3]
  const torch::Tensor x = relative.select(-1, 0), y = relative.select(-1, 1);
  torch::Tensor re = x * x - y * y, im = 2 * x * y;  // z²
  const torch::Tensor square = x * x + y * y;
  if (n == 4) {
    const torch::Tensor re4 = re * re - im * im, im4 = 2 * re * im;
    re = re4 / (square + 1e-6);
    im = im4 / (square + 1e-6);
  }
  const torch::Tensor total = (weights * square).sum(-1) + 1e-7;
  const torch::Tensor m_re = (weights * re).sum(-1) / total,
                      m_im = (weights * im).sum(-1) / total;  // |m| <= 1

  // The angle itself has no derivative where the moment vanishes: the same value with a derivative held back
  // there.
  const torch::Tensor re0 = m_re.detach(), im0 = m_im.detach();
  const torch::Tensor change = (re0 * m_im - im0 * m_re) / (re0 * re0 + im0 * im0 + 0.02);
  torch::Tensor angle = (torch::atan2(im0, re0) + change) / n + offset;
  const torch::Tensor tool = torch::atan2(tool_x.select(-1, 1), tool_x.select(-1, 0)).unsqueeze(1);
  const double period = 2 * std::numbers::pi / n;
  angle = angle + period * torch::round((tool - angle.detach()) / period);
  return torch::stack({angle.cos(), angle.sin(), torch::zeros_like(angle)}, -1);
}

}  // namespace flowscope
