#include "policy/objective.h"

#include <stdexcept>

#include "policy/diffusion.h"
#include "policy/flow_matching.h"

namespace flowscope {

std::unique_ptr<Objective> make_objective(const std::string& name, const std::string& times) {
  auto flow_matching = std::make_unique<FlowMatching>(times);  // refuses unknown times, whoever uses them
  if (name == "cfm") return flow_matching;
  if (name == "ddim") return std::make_unique<Diffusion>(Diffusion::Sampler::ddim);
  if (name == "ddpm") return std::make_unique<Diffusion>(Diffusion::Sampler::ddpm);
  throw std::invalid_argument("objective '" + name + "' is not available; there are: cfm, ddim, ddpm");
}

}  // namespace flowscope
