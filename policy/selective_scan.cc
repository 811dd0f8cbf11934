#include "policy/selective_scan.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <vector>

#include "policy/flush_denormals.h"
#include "policy/mamba_kernels.h"
#include "policy/scan_by_tensors.h"
#include "policy/tensor_rows.h"

namespace flowscope {
namespace {

constexpr const char* kName = "selective_scan";

void check(const ScanArguments& a) {
  for (const auto* tensor : {&a.u, &a.B}) {
    if (!tensor->defined() || tensor->dim() != 3) {
      throw std::invalid_argument("selective_scan: u and B must have three dimensions");
    }
  }
  const std::int64_t batch = a.u.size(0), length = a.u.size(1), channels = a.u.size(2), states = a.B.size(2);
  if (states < 1 || states > kMaxScanStates) {
    throw std::invalid_argument("selective_scan: 1 to 64 states, not " + std::to_string(states));
  }
  require_float(kName, "u", a.u, {batch, length, channels});
  require_float(kName, "delta", a.delta, {batch, length, channels});
  require_float(kName, "A", a.A, {channels, states});
  require_float(kName, "B", a.B, {batch, length, states});
  require_float(kName, "C", a.C, {batch, length, states});
  require_float(kName, "D", a.D, {channels});
  if (a.z.defined()) require_float(kName, "z", a.z, {batch, length, channels});
  if (a.h0.defined()) require_float(kName, "h0", a.h0, {batch, channels, states});
}

/// The arguments in the layout that the kernels read; holds what `inputs` points into. h0 is [batch, states,
/// channels] here.
struct Prepared {
  torch::Tensor u, delta, z, B, C, A_by_state, D, h0;
  ScanInputs inputs;

  Prepared(const ScanArguments& a, const torch::Tensor& h0_by_state)
      : u(with_even_rows(a.u)),
        delta(with_even_rows(a.delta)),
        B(with_even_rows(a.B)),
        C(with_even_rows(a.C)),
        A_by_state(a.A.t().contiguous()),
        D(a.D.contiguous()) {
    inputs.shape = {a.u.size(0), a.u.size(1), a.u.size(2), a.B.size(2)};
    inputs.u = rows_of(u), inputs.delta = rows_of(delta), inputs.B = rows_of(B), inputs.C = rows_of(C);
    if (a.z.defined()) z = with_even_rows(a.z), inputs.z = rows_of(z);
    inputs.A = A_by_state.data_ptr<float>(), inputs.D = D.data_ptr<float>();
    if (h0_by_state.defined()) {
      h0 = h0_by_state.contiguous();
      inputs.h0 = h0.data_ptr<float>();
    }
  }
};

/// Channels do not meet in the forward pass, so a small batch is also cut along them.
void run_forward(const MambaKernels& kernels, const ScanInputs& inputs, const ScanOutputs& outputs) {
  constexpr std::int64_t kWantedTasks = 8;
  const std::int64_t batch = inputs.shape.batch, blocks = kernels.blocks(inputs.shape.channels);
  if (batch == 0 || blocks == 0) return;
  const std::int64_t parts = std::clamp(kWantedTasks / batch, std::int64_t{1}, blocks);
  at::parallel_for(0, batch * parts, 1, [&](std::int64_t begin, std::int64_t end) {
    const FlushDenormals flush;
    for (std::int64_t task = begin; task < end; ++task) {
      const std::int64_t part = task % parts;
      kernels.scan_forward(inputs, outputs, task / parts, part * blocks / parts, (part + 1) * blocks / parts);
    }
  });
}

void run_backward(const MambaKernels& kernels, const ScanInputs& inputs, const ScanGradients& gradients) {
  at::parallel_for(0, inputs.shape.batch, 1, [&](std::int64_t begin, std::int64_t end) {
    const FlushDenormals flush;
    std::vector<float> scratch(kernels.scratch_floats(inputs.shape));
    for (std::int64_t item = begin; item < end; ++item) {
      kernels.scan_backward(inputs, gradients, item, scratch.data());
    }
  });
}

float* data_or_null(const torch::Tensor& tensor) {
  return tensor.defined() ? tensor.data_ptr<float>() : nullptr;
}

c10::optional<torch::Tensor> if_defined(const torch::Tensor& tensor) {
  return tensor.defined() ? c10::make_optional(tensor) : c10::nullopt;
}

/// The kernels' layout of states on both sides, [batch, states, channels].
class ScanFunction : public torch::autograd::Function<ScanFunction> {
 public:
  static torch::autograd::variable_list forward(torch::autograd::AutogradContext* context,
                                                const torch::Tensor& u, const torch::Tensor& delta,
                                                const torch::Tensor& A, const torch::Tensor& B,
                                                const torch::Tensor& C, const torch::Tensor& D,
                                                const c10::optional<torch::Tensor>& gate,
                                                const c10::optional<torch::Tensor>& start,
                                                const MambaKernels* kernels) {
    const torch::Tensor z = gate.value_or(torch::Tensor()), h0 = start.value_or(torch::Tensor());
    const Prepared prepared({u, delta, A, B, C, D, z}, h0);
    const ScanShape& shape = prepared.inputs.shape;
    torch::Tensor y = torch::empty(u.sizes(), u.options());
    torch::Tensor chunk_states =
        torch::empty({shape.batch, shape.chunks(), shape.states, shape.channels}, u.options());
    torch::Tensor last_state = torch::empty({shape.batch, shape.states, shape.channels}, u.options());
    run_forward(*kernels, prepared.inputs,
                {y.data_ptr<float>(), chunk_states.data_ptr<float>(), last_state.data_ptr<float>()});
    context->save_for_backward({u, delta, A, B, C, D, z, chunk_states});
    context->saved_data["kernels"] = reinterpret_cast<std::int64_t>(kernels);
    context->saved_data["has_start"] = h0.defined();
    context->set_materialize_grads(false);  // the last state mostly has none
    return {y, last_state};
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& output_gradients) {
    refuse_second_derivative(kName);
    const auto saved = context->get_saved_variables();
    const auto* kernels = reinterpret_cast<const MambaKernels*>(context->saved_data["kernels"].toInt());
    const Prepared prepared({saved[0], saved[1], saved[2], saved[3], saved[4], saved[5], saved[6]}, {});
    const ScanShape& shape = prepared.inputs.shape;
    const auto options = saved[0].options();
    const torch::Tensor dy = output_gradients[0].defined() ? output_gradients[0].contiguous()
                                                           : torch::zeros(saved[0].sizes(), options);
    const torch::Tensor dlast =
        output_gradients[1].defined() ? output_gradients[1].contiguous() : torch::Tensor();
    const auto like_u = [&] { return torch::empty(dy.sizes(), options); };
    const std::int64_t blocks = kernels->blocks(shape.channels);
    torch::Tensor du = like_u(), ddelta = like_u(), dz, dh0;
    if (saved[6].defined()) dz = like_u();
    if (context->saved_data["has_start"].toBool()) {
      dh0 = torch::empty({shape.batch, shape.states, shape.channels}, options);
    }
    torch::Tensor dB = torch::empty({shape.batch, shape.length, shape.states}, options);
    torch::Tensor dC = torch::empty_like(dB);
    torch::Tensor dA = torch::empty({shape.batch, blocks, shape.states, kernels->width}, options);
    torch::Tensor dD = torch::empty({shape.batch, blocks, kernels->width}, options);
    ScanGradients gradients;
    gradients.dy = dy.data_ptr<float>(), gradients.chunk_states = saved[7].data_ptr<float>();
    gradients.du = du.data_ptr<float>(), gradients.ddelta = ddelta.data_ptr<float>();
    gradients.dz = data_or_null(dz), gradients.dh0 = data_or_null(dh0);
    gradients.dB = dB.data_ptr<float>(), gradients.dC = dC.data_ptr<float>();
    gradients.dA = dA.data_ptr<float>(), gradients.dD = dD.data_ptr<float>();
    gradients.dlast_state = data_or_null(dlast);
    run_backward(*kernels, prepared.inputs, gradients);
    // From blocks of `width` channels back to one row per channel.
    const torch::Tensor dA_rows = sum_in_order(dA).transpose(1, 2).reshape({-1, shape.states});
    const torch::Tensor dD_row = sum_in_order(dD).reshape({-1});
    return {du, ddelta, dA_rows.narrow(0, 0, shape.channels),
            dB, dC,     dD_row.narrow(0, 0, shape.channels),
            dz, dh0,    {}};
  }
};

/// Without chunk states, which only a backward pass reads.
ScanResult run_without_gradient(const MambaKernels& kernels, const ScanArguments& a) {
  const torch::NoGradGuard no_grad;
  const Prepared prepared(a, a.h0.defined() ? a.h0.transpose(1, 2) : a.h0);
  const ScanShape& shape = prepared.inputs.shape;
  const torch::Tensor y = torch::empty(a.u.sizes(), a.u.options());
  const torch::Tensor last = torch::empty({shape.batch, shape.states, shape.channels}, a.u.options());
  run_forward(kernels, prepared.inputs, {y.data_ptr<float>(), nullptr, last.data_ptr<float>()});
  return {y, last.transpose(1, 2)};
}

bool wants_gradient(const ScanArguments& a) {
  const auto differentiated = {&a.u, &a.delta, &a.A, &a.B, &a.C, &a.D, &a.z, &a.h0};
  return torch::GradMode::is_enabled() &&
         std::any_of(differentiated.begin(), differentiated.end(), [](const torch::Tensor* tensor) {
           return tensor->defined() && tensor->requires_grad();
         });
}

}  // namespace

ScanResult selective_scan_on(const MambaKernels& kernels, const ScanArguments& a) {
  check(a);
  if (!wants_gradient(a)) return run_without_gradient(kernels, a);
  const torch::Tensor h0 = a.h0.defined() ? a.h0.transpose(1, 2) : a.h0;
  const auto result =
      ScanFunction::apply(a.u, a.delta, a.A, a.B, a.C, a.D, if_defined(a.z), if_defined(h0), &kernels);
  return {result[0], result[1].transpose(1, 2)};
}

ScanResult selective_scan(const ScanArguments& arguments) {
  if (arguments.u.defined() && !arguments.u.is_cpu()) return scan_by_tensors(arguments);
  return selective_scan_on(*supported_mamba_kernels().front(), arguments);
}

}  // namespace flowscope
