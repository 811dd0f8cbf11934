#include "policy/causal_conv.h"

#include <ATen/Parallel.h>

#include "policy/flush_denormals.h"
#include "policy/mamba_kernels.h"
#include "policy/scan_by_tensors.h"
#include "policy/tensor_rows.h"

namespace flowscope {
namespace {

constexpr const char* kName = "causal_conv_silu";

/// Of tensors that the caller keeps; x with even rows, the others contiguous.
ConvInputs conv_inputs(const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias,
                       const torch::Tensor& tail) {
  ConvInputs inputs;
  inputs.batch = x.size(0), inputs.length = x.size(1), inputs.channels = x.size(2);
  inputs.taps = weight.size(0);
  inputs.x = rows_of(x), inputs.weight = weight.data_ptr<float>(), inputs.bias = bias.data_ptr<float>();
  if (tail.defined() && inputs.taps > 1) inputs.tail = tail.data_ptr<float>();
  return inputs;
}

class ConvFunction : public torch::autograd::Function<ConvFunction> {
 public:
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& x,
                               const torch::Tensor& weight, const torch::Tensor& bias,
                               const c10::optional<torch::Tensor>& before, const MambaKernels* kernels) {
    const torch::Tensor rows = with_even_rows(x), tail = before.value_or(torch::Tensor());
    torch::Tensor y = torch::empty(x.sizes(), x.options());
    const ConvInputs inputs = conv_inputs(rows, weight, bias, tail);
    at::parallel_for(0, inputs.batch, 1, [&](std::int64_t begin, std::int64_t end) {
      const FlushDenormals flush;
      for (std::int64_t item = begin; item < end; ++item) {
        kernels->conv_forward(inputs, y.data_ptr<float>(), item);
      }
    });
    context->save_for_backward({x, weight, bias, tail});
    context->saved_data["kernels"] = reinterpret_cast<std::int64_t>(kernels);
    return y;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& output_gradients) {
    refuse_second_derivative(kName);
    const auto saved = context->get_saved_variables();
    const auto* kernels = reinterpret_cast<const MambaKernels*>(context->saved_data["kernels"].toInt());
    const torch::Tensor rows = with_even_rows(saved[0]), dy = output_gradients[0].contiguous();
    const ConvInputs inputs = conv_inputs(rows, saved[1], saved[2], saved[3]);
    torch::Tensor dx = torch::empty(dy.sizes(), dy.options());
    torch::Tensor dweight = torch::empty({inputs.batch, inputs.taps, inputs.channels}, dy.options());
    torch::Tensor dbias = torch::empty({inputs.batch, inputs.channels}, dy.options());
    const torch::Tensor dtail = saved[3].defined() ? torch::empty_like(saved[3]) : torch::Tensor();
    const ConvGradients gradients{dy.data_ptr<float>(), dx.data_ptr<float>(), dweight.data_ptr<float>(),
                                  dbias.data_ptr<float>(),
                                  dtail.defined() ? dtail.data_ptr<float>() : nullptr};
    at::parallel_for(0, inputs.batch, 1, [&](std::int64_t begin, std::int64_t end) {
      const FlushDenormals flush;
      for (std::int64_t item = begin; item < end; ++item) kernels->conv_backward(inputs, gradients, item);
    });
    return {dx, sum_in_order(dweight), sum_in_order(dbias), dtail, {}};
  }
};

}  // namespace

torch::Tensor causal_conv_silu_on(const MambaKernels& kernels, const torch::Tensor& x,
                                  const torch::Tensor& weight, const torch::Tensor& bias,
                                  const torch::Tensor& tail) {
  if (!x.defined() || x.dim() != 3 || !weight.defined() || weight.dim() != 2) {
    throw std::invalid_argument("causal_conv_silu: x must have three dimensions and weight two");
  }
  const std::int64_t channels = x.size(2), taps = weight.size(0);
  if (taps < 1 || taps > kMaxConvTaps) {
    throw std::invalid_argument("causal_conv_silu: 1 to 8 taps, not " + std::to_string(taps));
  }
  require_float(kName, "x", x, {x.size(0), x.size(1), channels});
  require_float(kName, "weight", weight, {taps, channels});
  require_float(kName, "bias", bias, {channels});
  c10::optional<torch::Tensor> before;
  if (tail.defined()) {
    require_float(kName, "tail", tail, {x.size(0), taps - 1, channels});
    before = tail.contiguous();
  }
  return ConvFunction::apply(x, weight.contiguous(), bias.contiguous(), before, &kernels);
}

torch::Tensor causal_conv_silu(const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias,
                               const torch::Tensor& tail) {
  if (x.defined() && !x.is_cpu()) return causal_conv_silu_by_tensors(x, weight, bias, tail);
  return causal_conv_silu_on(*supported_mamba_kernels().front(), x, weight, bias, tail);
}

}  // namespace flowscope
