#include "policy/replicas.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <atomic>
#include <exception>

namespace flowscope {

Replicas::Replicas(const FlowRamNetwork& network, const NetworkShape& shape, const std::string& backbone,
                   int count)
    : networks_{network}, crew_(std::make_unique<PartCrew>()) {
  const torch::NoGradGuard no_grad;
  for (int i = 1; i < count; ++i) {
    FlowRamNetwork copy(shape, backbone, network->trunk());
    auto shared = network->named_parameters();
    for (auto& item : copy->named_parameters()) item.value().set_data(shared[item.key()].detach());
    networks_.push_back(copy);
  }
}

void Replicas::run(int threads, const std::function<void(int, FlowRamNetwork&)>& work) {
  std::atomic<int> next{0};
  std::vector<std::exception_ptr> failed(networks_.size());
  const auto take_parts = [&] {
    for (int part = next++; part < count(); part = next++) {
      try {
        work(part, networks_[static_cast<std::size_t>(part)]);
      } catch (...) {
        failed[static_cast<std::size_t>(part)] = std::current_exception();
      }
    }
  };
  const int before = at::get_num_threads();
  at::set_num_threads(1);  // of the calling thread
  crew_->run(std::min(threads, count()) - 1, take_parts);
  at::set_num_threads(before);
  for (const std::exception_ptr& e : failed)
    if (e) std::rethrow_exception(e);

  const auto total = networks_.front()->parameters();
  for (std::size_t r = 1; r < networks_.size(); ++r) {
    const auto parts = networks_[r]->parameters();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      torch::Tensor& part = parts[i].mutable_grad();
      if (!part.defined()) continue;
      torch::Tensor& sum = total[i].mutable_grad();
      if (sum.defined())
        sum.add_(part);
      else
        sum = part.clone();
      part.reset();
    }
  }
}

}  // namespace flowscope
