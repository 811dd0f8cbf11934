#include "policy/pointwise.h"

#include <ATen/Parallel.h>

#include "policy/flush_denormals.h"
#include "policy/tensor_rows.h"
#include "policy/token_kernels.h"

namespace flowscope {
namespace {

constexpr std::int64_t kGrain = 8192;  // numbers per task: below it a second thread costs more than it does

using Value = void (*TokenKernels::*)(const float*, float*, std::int64_t);
using Slope = void (*TokenKernels::*)(const float*, const float*, float*, std::int64_t);

template <Value value, Slope slope>
class Pointwise : public torch::autograd::Function<Pointwise<value, slope>> {
 public:
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& x) {
    const torch::Tensor from = x.contiguous(), y = torch::empty_like(from);
    const float* const read = from.data_ptr<float>();
    float* const write = y.template data_ptr<float>();
    const TokenKernels& kernels = *supported_token_kernels().front();
    at::parallel_for(0, from.numel(), kGrain, [&](std::int64_t begin, std::int64_t end) {
      const FlushDenormals flush;
      (kernels.*value)(read + begin, write + begin, end - begin);
    });
    context->save_for_backward({from});
    return y;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& output_gradients) {
    refuse_second_derivative("a pointwise function");
    const torch::Tensor x = context->get_saved_variables()[0], dy = output_gradients[0].contiguous(),
                        dx = torch::empty_like(x);
    const float *const read = x.data_ptr<float>(), *const above = dy.data_ptr<float>();
    float* const write = dx.template data_ptr<float>();
    const TokenKernels& kernels = *supported_token_kernels().front();
    at::parallel_for(0, x.numel(), kGrain, [&](std::int64_t begin, std::int64_t end) {
      const FlushDenormals flush;
      (kernels.*slope)(read + begin, above + begin, write + begin, end - begin);
    });
    return {dx};
  }
};

bool ours(const torch::Tensor& x) { return x.device().is_cpu() && x.scalar_type() == torch::kFloat32; }

}  // namespace

torch::Tensor gelu_of(const torch::Tensor& x) {
  if (!ours(x)) return torch::gelu(x);
  return Pointwise<&TokenKernels::gelu_of, &TokenKernels::gelu_gradient>::apply(x);
}

torch::Tensor softplus_of(const torch::Tensor& x) {
  if (!ours(x)) return torch::softplus(x);
  return Pointwise<&TokenKernels::softplus_of, &TokenKernels::softplus_gradient>::apply(x);
}

}  // namespace flowscope
