#include "policy/data_parallel.h"

namespace flowscope {
namespace {

void share(torch::Tensor tensor, GradientExchange& exchange) {
  const torch::NoGradGuard no_grad;
  const torch::Tensor here = tensor.detach().cpu().contiguous();
  exchange.broadcast(here.data_ptr(), here.nbytes());
  tensor.copy_(here);
}

}  // namespace

void share_weights(const Model& model, const AdamW& optimizer, GradientExchange& exchange) {
  if (exchange.size() == 1) return;
  for (const torch::Tensor& weight : model.network->parameters()) share(weight, exchange);
  for (const auto& [name, tensor] : optimizer.state()) share(tensor, exchange);
}

void average_over_ranks(AdamW& optimizer, StepLoss& loss, GradientExchange& exchange) {
  if (exchange.size() == 1) return;
  std::vector<float> all = optimizer.gradients();
  const std::size_t gradients = all.size();
  const std::initializer_list<double*> losses = {&loss.total, &loss.flow, &loss.position, &loss.rotation,
                                                 &loss.open};
  for (const double* part : losses) all.push_back(static_cast<float>(*part));
  exchange.sum(all.data(), all.size());
  const auto share_of_one = static_cast<float>(1.0 / exchange.size());
  for (float& number : all) number *= share_of_one;
  std::size_t at = gradients;
  for (double* part : losses) *part = all[at++];
  all.resize(gradients);
  optimizer.set_gradients(all);
}

}  // namespace flowscope
