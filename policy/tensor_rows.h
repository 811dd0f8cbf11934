// What the fused operators ask of the tensors that they get.
#pragma once

#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <string>

#include "policy/mamba_kernels.h"
#include "policy/torch_parts.h"

namespace flowscope {

/// Throws std::invalid_argument "op: name must be float32 [a, b, c], not …" unless `tensor` is just that.
inline void require_float(const char* op, const char* name, const torch::Tensor& tensor,
                          std::initializer_list<std::int64_t> shape) {
  const at::IntArrayRef wanted(shape);
  if (tensor.defined() && tensor.device().is_cpu() && tensor.scalar_type() == torch::kFloat32 &&
      tensor.sizes() == wanted) {
    return;
  }
  std::ostringstream text;
  text << op << ": " << name << " must be float32 " << wanted << ", not ";
  if (tensor.defined()) {
    text << tensor.toString() << " " << tensor.sizes();
  } else {
    text << "absent";
  }
  throw std::invalid_argument(text.str());
}

/// `tensor` [batch, length, columns] itself where its rows lie evenly, such as a slice of columns; else a
/// copy.
inline torch::Tensor with_even_rows(const torch::Tensor& tensor) {
  const bool dense_row = tensor.size(2) <= 1 || tensor.stride(2) == 1;
  const bool even =
      tensor.size(0) <= 1 || tensor.size(1) <= 1 || tensor.stride(0) == tensor.size(1) * tensor.stride(1);
  return dense_row && even ? tensor : tensor.contiguous();
}

/// Of a tensor that with_even_rows returned and the caller keeps.
inline Rows rows_of(const torch::Tensor& tensor) {
  return {tensor.data_ptr<float>(), tensor.size(1) > 1 ? tensor.stride(1) : tensor.stride(0)};
}

/// shares [items, …] -> their sum in the order of the items, whatever the number of threads.
inline torch::Tensor sum_in_order(const torch::Tensor& shares) {
  const std::int64_t items = shares.size(0), count = items > 0 ? shares.numel() / items : 0;
  torch::Tensor total = torch::zeros(shares.sizes().slice(1), shares.options());
  float* to = total.data_ptr<float>();
  for (std::int64_t item = 0; item < items; ++item) {
    const float* from = shares.data_ptr<float>() + item * count;
    for (std::int64_t i = 0; i < count; ++i) to[i] += from[i];
  }
  return total;
}

/// Inside a backward pass: refuses a second differentiation, which the kernels would silently answer with
/// zeros.
inline void refuse_second_derivative(const char* op) {
  if (torch::GradMode::is_enabled()) throw std::logic_error(std::string(op) + ": has no second derivative");
}

}  // namespace flowscope
