#include "policy/weights_io.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "policy/checkpoint.h"
#include "policy/preset_fields.h"
#include "policy/safetensors.h"
#include "policy/shape_limits.h"

namespace flowscope {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* format = "flowscope-weights/1";

/// Part and name of every value in the config; writing and reading differ only in what `field` does.
template <typename ModelLike, typename ProgressLike, typename Field>
void visit_config(ModelLike& model, ProgressLike& progress, Field&& field) {
  const auto inside = [&field](const char* part) {
    return [&field, part](const char* name, auto& value) { field(part, name, value); };
  };
  visit_shape(model.shape, inside("shape"));
  visit_later_shape(model.shape, inside("shape"));
  field("radius", "kind", model.radius.kind);
  visit_radius(model.radius, inside("radius"));
  field("policy", "backbone", model.backbone);
  field("policy", "objective", model.objective_name);
  field("policy", "preset", progress.options.preset);
  field("policy", "steps", progress.status.step);
  visit_rates(progress.rates, inside("rates"));
  visit_later_rates(progress.rates, inside("rates"));
}

Json config_of(const LoadedCheckpoint& loaded) {
  Json json;
  visit_config(loaded.model, loaded.progress,
               [&json](const char* part, const char* name, const auto& value) { json[part][name] = value; });
  const Box& box = loaded.model.bounds;
  json["bounds"] = {{"min", {box.min.x(), box.min.y(), box.min.z()}},
                    {"max", {box.max.x(), box.max.y(), box.max.z()}}};
  json["words"] = loaded.model.vocabulary.known();
  if (loaded.model.clip) json["policy"]["clip_identity"] = loaded.model.clip->identity;
  return json;
}

Eigen::Vector3d corner(const Json& bounds, const char* name) {
  const auto numbers = bounds.at(name).get<std::vector<double>>();
  if (numbers.size() != 3 || !std::ranges::all_of(numbers, [](double v) { return std::isfinite(v); }))
    throw std::invalid_argument(std::string("config bounds.") + name + " is not three numbers");
  return {numbers[0], numbers[1], numbers[2]};
}

/// The model without its weights, and what training starts from.
LoadedCheckpoint model_of(const Json& config) {
  Model described;
  TrainProgress progress;
  progress.options.preset = config.at("policy").value("preset", progress.options.preset);
  progress.rates = load_preset(progress.options.preset).rates;
  visit_config(described, progress, [&config](const std::string& part, const char* name, auto& value) {
    const bool optional = part == "rates" || std::string_view(name) == "steps";
    if (optional && !(config.contains(part) && config[part].contains(name))) return;
    if (!config.contains(part) || !config[part].contains(name))
      throw std::invalid_argument("config " + part + "." + name + " is missing");
    try {
      config[part][name].get_to(value);
    } catch (const Json::exception& error) {
      throw std::invalid_argument("config " + part + "." + name + ": " + error.what());
    }
  });
  require_sane(described.shape);
  progress.options.radius = described.radius.kind;
  const auto clip = clip_for(described.shape, "");
  if (clip && clip->identity != config.at("policy").value("clip_identity", ""))
    throw std::invalid_argument("config policy.clip_identity is not that of the CLIP weights in use");
  LoadedCheckpoint made{
      make_model(described.shape, described.radius, described.backbone, described.objective_name, 0, clip),
      nullptr, std::move(progress)};
  made.model.bounds = {corner(config.at("bounds"), "min"), corner(config.at("bounds"), "max")};
  made.model.scale = PositionScale::from_bounds(made.model.bounds);
  const auto words = config.at("words").get<std::vector<std::string>>();
  if (Vocabulary::first + words.size() > static_cast<std::size_t>(described.shape.vocabulary))
    throw std::invalid_argument("config words: more than the vocabulary's rows");
  made.model.vocabulary.restore(words);
  return made;
}

std::string shape_text(const torch::Tensor& tensor) {
  std::string text;
  for (const auto size : tensor.sizes()) text += (text.empty() ? "" : ", ") + std::to_string(size);
  return "[" + text + "]";
}

/// One line per tensor that does not fit.
std::vector<std::string> misfits(const TensorsByName& given, const TensorsByName& wanted) {
  std::vector<std::string> lines;
  for (const auto& [name, place] : wanted) {
    const auto found = given.find(name);
    if (found == given.end())
      lines.push_back("tensor " + name + " " + shape_text(place) + " is missing");
    else if (found->second.sizes() != place.sizes())
      lines.push_back("tensor " + name + " is " + shape_text(found->second) + ", not " + shape_text(place));
    else if (found->second.scalar_type() != torch::kFloat32)
      lines.push_back("tensor " + name + " holds no floating-point numbers");
    else if (!torch::isfinite(found->second).all().item<bool>())
      lines.push_back("tensor " + name + " holds numbers that are not finite");
  }
  for (const auto& [name, tensor] : given)
    if (!wanted.contains(name)) lines.push_back("tensor " + name + " belongs nowhere");
  return lines;
}

TensorsByName parameters_of(const Model& model) {
  TensorsByName parameters;
  for (const auto& item : model.network->named_parameters()) parameters[item.key()] = item.value().detach();
  return parameters;
}

void take_weights(Model& model, const TensorsByName& given) {
  const torch::NoGradGuard no_grad;
  TensorsByName places = parameters_of(model);
  const std::vector<std::string> wrong = misfits(given, places);
  if (!wrong.empty()) {
    std::string text;
    for (const std::string& line : wrong) text += "\n  " + line;
    throw std::invalid_argument(std::to_string(wrong.size()) + " tensors do not fit:" + text);
  }
  for (auto& [name, place] : places) place.copy_(given.at(name));
}

}  // namespace

void export_weights(const std::filesystem::path& policy, const std::filesystem::path& safetensors) {
  LoadedCheckpoint loaded = read_checkpoint(policy);
  loaded.optimizer->swap_mean();
  write_safetensors(safetensors, parameters_of(loaded.model),
                    {{"format", format}, {"config", config_of(loaded).dump()}});
}

void import_weights(const std::filesystem::path& safetensors, const std::filesystem::path& policy) {
  TextByName metadata;
  const TensorsByName tensors = read_safetensors(safetensors, &metadata);
  try {
    if (metadata["format"] != format)
      throw std::invalid_argument(std::string("__metadata__ \"format\" is not ") + format);
    LoadedCheckpoint made = model_of(Json::parse(metadata["config"]));
    take_weights(made.model, tensors);
    made.optimizer = make_optimizer(made.model, made.progress.rates);
    write_checkpoint(policy, made.model, *made.optimizer, made.progress);
  } catch (const Json::exception& error) {
    throw BadCheckpoint(safetensors.string() + ": config: " + error.what());
  } catch (const std::invalid_argument& error) {
    throw BadCheckpoint(safetensors.string() + ": " + error.what());
  }
}

}  // namespace flowscope
