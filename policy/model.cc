#include "policy/model.h"

namespace flowscope {

Model make_model(const NetworkShape& shape, const RadiusSchedule& radius, const std::string& backbone,
                 const std::string& objective, std::uint64_t seed) {
  Model model;
  model.shape = shape;
  model.radius = radius;
  model.radius.radius_m(0);  // refuses an unknown kind
  model.backbone = backbone;
  model.objective_name = objective;
  model.objective = make_objective(objective);
  model.vocabulary = Vocabulary(shape.vocabulary);
  torch::manual_seed(seed);
  model.network = FlowRamNetwork(shape, backbone);
  return model;
}

}  // namespace flowscope
