#include "policy/model.h"

#include <cstdlib>
#include <stdexcept>

#include "policy/clip/phrases.h"

namespace flowscope {

Model make_model(const NetworkShape& shape, const RadiusSchedule& radius, const std::string& backbone,
                 const std::string& objective, std::uint64_t seed, std::shared_ptr<const ClipEncoders> clip) {
  Model model;
  model.shape = shape;
  model.radius = radius;
  model.radius.radius_m(0);  // refuses an unknown kind
  model.backbone = backbone;
  model.objective_name = objective;
  model.objective = make_objective(objective);
  model.vocabulary = Vocabulary(shape.vocabulary);
  torch::manual_seed(seed);
  model.clip = std::move(clip);
  if (shape.text_branch == "clip") model.vocabulary.use(std::make_shared<ClipPhrases>(model.clip));
  const bool looks = shape.image_branch == "clip" && model.clip;
  model.network = FlowRamNetwork(shape, backbone, looks ? model.clip->image : nullptr);
  return model;
}

std::shared_ptr<const ClipEncoders> clip_for(const NetworkShape& shape, const std::string& file) {
  if (shape.image_branch != "clip" && shape.text_branch != "clip") return nullptr;
  const char* named = std::getenv("FLOWSCOPE_CLIP");
  const std::string path = !file.empty() ? file : named ? named : "";
  if (path.empty())
    throw std::invalid_argument(
        "this policy reads with CLIP: name the converted weights with --clip FILE or FLOWSCOPE_CLIP "
        "(flowscope policy convert makes the file)");
  return std::make_shared<const ClipEncoders>(read_clip(path));
}

}  // namespace flowscope
