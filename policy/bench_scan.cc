#include "policy/bench_scan.h"

#include "policy/bench_timer.h"
#include "policy/causal_conv.h"
#include "policy/mamba.h"
#include "policy/mamba_kernels.h"
#include "policy/plain_scan.h"
#include "policy/selective_scan.h"
#include "policy/torch_parts.h"

namespace flowscope {
namespace {

/// Random arguments that want gradients.
ScanArguments bench_arguments(const ScanBenchOptions& o) {
  const std::int64_t channels = 2 * o.d_model;
  const auto leaf = [](const torch::Tensor& t) { return t.detach().requires_grad_(); };
  ScanArguments a;
  a.u = leaf(torch::randn({o.batch, o.length, channels}));
  a.delta = leaf(0.1 * torch::rand({o.batch, o.length, channels}));
  a.A = leaf(-torch::arange(1, o.d_state + 1, torch::kFloat32).repeat({channels, 1}));
  a.B = leaf(torch::randn({o.batch, o.length, o.d_state}));
  a.C = leaf(torch::randn({o.batch, o.length, o.d_state}));
  a.D = leaf(torch::ones({channels}));
  a.z = leaf(torch::randn({o.batch, o.length, channels}));
  return a;
}

void forward_and_backward(const torch::Tensor& y) { y.backward(torch::ones_like(y)); }

/// The block's four products with the sizes of MambaBlock, nothing between them.
double products_ms(const ScanBenchOptions& o) {
  const std::int64_t channels = 2 * o.d_model, rank = (o.d_model + 15) / 16, columns = rank + 2 * o.d_state;
  const auto leaf = [](std::int64_t rows, std::int64_t width) {
    return torch::randn({rows, width}).requires_grad_();
  };
  const std::int64_t tokens = std::int64_t{o.batch} * o.length;
  const auto x = leaf(tokens, o.d_model), u = leaf(tokens, channels), low = leaf(tokens, rank),
             y = leaf(tokens, channels);
  const auto in = leaf(o.d_model, 2 * channels), parts = leaf(channels, columns), step = leaf(rank, channels),
             out = leaf(channels, o.d_model);
  return fastest_run_ms(o.repeats, [&] {
    for (const auto& [left, right] : {std::pair{x, in}, {u, parts}, {low, step}, {y, out}}) {
      forward_and_backward(left.mm(right));
    }
  });
}

}  // namespace

std::vector<BenchResult> bench_scan(const ScanBenchOptions& o) {
  torch::manual_seed(1);
  const ScanArguments a = bench_arguments(o);
  std::vector<BenchResult> results;
  const double loop = fastest_run_ms(1, [&] { forward_and_backward(plain_scan(a).y); });
  double fastest = 0;
  for (const MambaKernels* kernels : supported_mamba_kernels()) {
    const double ms =
        fastest_run_ms(o.repeats, [&] { forward_and_backward(selective_scan_on(*kernels, a).y); });
    if (fastest == 0) fastest = ms;
    results.push_back(
        {std::string("scan_train_") + kernels->name, ms, "ms", loop / ms, "loop of torch operators"});
  }
  const double forward = fastest_run_ms(o.repeats, [&] {
    const torch::NoGradGuard no_grad;
    selective_scan(a);
  });
  results.push_back({"scan_forward", forward, "ms", {}, {}});
  const double products = products_ms(o);
  results.push_back({"block_products_train", products, "ms", {}, {}});
  results.push_back({"scan_train", fastest, "ms", products / fastest, "the block's own matrix products"});

  MambaBlock block(MambaOptions{.d_model = o.d_model, .d_state = o.d_state});
  const torch::Tensor x = torch::randn({o.batch, o.length, o.d_model}).requires_grad_();
  const double whole = fastest_run_ms(o.repeats, [&] { forward_and_backward(block->forward(x)); });
  results.push_back({"mamba_block_train", whole, "ms", products / whole, "the block's own matrix products"});
  return results;
}

}  // namespace flowscope
