#include "policy/summary.h"

#include "policy/checkpoint.h"

namespace flowscope {
namespace {

PolicySummary summarise_model(const Model& model) {
  PolicySummary s;
  s.shape = model.shape;
  s.radius = model.radius;
  s.backbone = model.backbone;
  s.objective = model.objective_name;
  s.bounds = model.bounds;
  s.words = model.vocabulary.known();
  const auto work = cost_of(model.shape, model.backbone);
  for (const auto& child : model.network->named_children()) {
    PartSummary part{child.key(), 0, {}};
    for (const torch::Tensor& p : child.value()->parameters()) part.parameters += p.numel();
    if (const auto found = work.find(child.key()); found != work.end()) part.work = found->second;
    s.parameters += part.parameters;
    s.scene += part.work.scene;
    s.step += part.work.step;
    s.parts.push_back(std::move(part));
  }
  return s;
}

}  // namespace

PolicySummary summarise_policy(const std::filesystem::path& file) {
  const LoadedCheckpoint loaded = read_checkpoint(file);
  PolicySummary s = summarise_model(loaded.model);
  s.preset = loaded.progress.options.preset;
  s.steps = loaded.progress.status.step;
  s.minutes = loaded.progress.status.minutes;
  s.demonstrations = loaded.progress.status.demos;
  return s;
}

PolicySummary summarise_preset(const std::string& name, const std::string& backbone) {
  const Preset preset = load_preset(name);
  PolicySummary s = summarise_model(make_model(preset.shape, preset.radius, backbone, "cfm", 0));
  s.preset = name;
  return s;
}

}  // namespace flowscope
