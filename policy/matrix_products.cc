#include "policy/matrix_products.h"

#include <ATen/Parallel.h>
#include <ATen/record_function.h>
#include <c10/util/ThreadLocalDebugInfo.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <thread>

#include "policy/bench_timer.h"
#include "policy/torch_parts.h"

namespace flowscope {
namespace {

/// Where the first factor stands among the operator's arguments; -1: it is no product.
int first_factor(const std::string& name) {
  if (name == "aten::mm" || name == "aten::bmm") return 0;
  if (name == "aten::addmm" || name == "aten::baddbmm") return 1;
  return -1;
}

/// Travels with the thread's state, into backward passes too: torch's callback is a plain function.
struct Record : c10::DebugInfoBase {
  std::vector<MatrixProduct> products;
};
constexpr auto record_kind = c10::DebugInfoKind::TEST_INFO_2;

std::unique_ptr<at::ObserverContext> record(const at::RecordFunction& call) {
  auto* to = dynamic_cast<Record*>(c10::ThreadLocalDebugInfo::get(record_kind));
  const int at = first_factor(call.name());
  if (at < 0 || !to) return nullptr;
  const auto inputs = call.inputs();
  const torch::Tensor left = inputs[static_cast<std::size_t>(at)].toTensor(),
                      right = inputs[static_cast<std::size_t>(at) + 1].toTensor();
  to->products.push_back(
      {left.sizes().vec(), left.strides().vec(), right.sizes().vec(), right.strides().vec()});
  return nullptr;
}

/// Removed again whatever the work throws.
struct Callback {
  at::CallbackHandle handle = at::addThreadLocalCallback(
      at::RecordFunctionCallback(record).needsInputs(true).scopes({at::RecordScope::FUNCTION}));
  Callback() = default;
  Callback(const Callback&) = delete;
  Callback& operator=(const Callback&) = delete;
  ~Callback() { at::removeCallback(handle); }
};

/// Factors and result of a product, in memory.
struct Ready {
  torch::Tensor left, right, out;
};

torch::Tensor factor(const std::vector<std::int64_t>& size, const std::vector<std::int64_t>& stride) {
  std::int64_t reach = 1;
  for (std::size_t i = 0; i < size.size(); ++i) reach += std::max<std::int64_t>(0, size[i] - 1) * stride[i];
  return torch::rand({reach}).as_strided(size, stride);
}

Ready make_ready(const MatrixProduct& p) {
  const torch::Tensor left = factor(p.left_size, p.left_stride), right = factor(p.right_size, p.right_stride);
  return {left, right, torch::matmul(left, right)};
}

void multiply(std::vector<Ready>& products, std::size_t begin, std::size_t end) {
  const torch::NoGradGuard no_grad;
  for (std::size_t i = begin; i < end; ++i) {
    Ready& r = products[i];
    if (r.left.dim() == 2)
      at::mm_out(r.out, r.left, r.right);
    else
      at::bmm_out(r.out, r.left, r.right);
  }
}

}  // namespace

std::int64_t MatrixProduct::multiply_adds() const {
  return std::accumulate(left_size.begin(), left_size.end(), std::int64_t{1}, std::multiplies<>()) *
         right_size.back();
}

std::vector<MatrixProduct> record_products(const std::function<void()>& work) {
  const auto found = std::make_shared<Record>();
  const c10::DebugInfoGuard known(record_kind, found);
  const Callback callback;
  work();
  return std::move(found->products);
}

double products_ms(const std::vector<MatrixProduct>& products, int repeats, int shares) {
  std::vector<Ready> ready;
  for (const MatrixProduct& p : products) ready.push_back(make_ready(p));
  if (shares <= 0) return fastest_run_ms(repeats, [&] { multiply(ready, 0, ready.size()); });
  const auto count = static_cast<std::size_t>(shares);
  const int before = at::get_num_threads();
  at::set_num_threads(1);
  const double ms = fastest_run_ms(repeats, [&] {
    std::vector<std::jthread> others;
    for (std::size_t t = 1; t < count; ++t)
      others.emplace_back([&, t] {
        at::set_num_threads(1);
        multiply(ready, ready.size() * t / count, ready.size() * (t + 1) / count);
      });
    multiply(ready, 0, ready.size() / count);
  });
  at::set_num_threads(before);
  return ms;
}

}  // namespace flowscope
