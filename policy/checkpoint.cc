#include "policy/checkpoint.h"

#include <nlohmann/json.hpp>

#include "policy/container.h"
#include "policy/preset_fields.h"
#include "policy/shape_limits.h"
#include "recorder/sha256.h"

namespace flowscope {
namespace {

using Json = nlohmann::ordered_json;

AdamWOptions optimizer_options(const TrainRates& r) {
  return {.beta1 = r.beta1,
          .beta2 = r.beta2,
          .epsilon = 1e-8,
          .weight_decay = r.weight_decay,
          .clip = r.clip,
          .ema = r.ema};
}

/// Walks every value that the header holds; writing and reading differ only in what `field` does.
template <typename Model, typename Progress, typename Field>
void visit_header(Model& m, Progress& p, Field&& field) {
  visit_shape(m.shape, field);
  visit_radius(m.radius, field);
  field("radius_kind", m.radius.kind);
  field("backbone", m.backbone);
  field("objective", m.objective_name);
  visit_rates(p.rates, field);
  field("preset", p.options.preset);
  field("seed", p.options.seed);
  field("expected_minutes", p.options.expected_minutes);
  field("step", p.status.step);
  field("minutes", p.status.minutes);
  field("loss", p.status.loss);
  field("samples_per_s", p.status.samples_per_s);
  field("random_state", p.random_state);
  field("optimizer_steps", p.optimizer_steps);
}

/// What came later: a file written before has it at its default.
template <typename Model, typename Progress, typename Field>
void visit_later(Model& m, Progress& p, Field&& field) {
  field("demos", p.status.demos);
  field("clip_file", p.options.clip);
  field("augment_move", p.options.augment.move);
  field("augment_recolor", p.options.augment.recolor);
  field("augment_repaint", p.options.augment.repaint);
  field("augment_shuffle", p.options.augment.shuffle);
  field("augment_crop", p.options.augment.crop);
  field("loss_flow", p.status.loss_flow);
  field("loss_open", p.status.loss_open);
  field("loss_position", p.status.loss_position);
  field("loss_rotation", p.status.loss_rotation);
  field("skipped", p.status.skipped);
  field("expected_steps", p.options.expected_steps);
  field("robot", p.options.robot);
  visit_later_shape(m.shape, field);
  visit_later_rates(p.rates, field);
}

std::vector<double> numbers_of(const Box& box) {
  return {box.min.x(), box.min.y(), box.min.z(), box.max.x(), box.max.y(), box.max.z()};
}

Box box_of(const std::vector<double>& n) {
  if (n.size() != 6) throw std::invalid_argument("bounds need six numbers");
  return {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
}

std::string header_of(const Model& model, const TrainProgress& progress) {
  Json json;
  const auto put = [&json](const char* name, const auto& value) { json[name] = value; };
  visit_header(model, progress, put);
  visit_later(model, progress, put);
  if (model.clip) json["clip_identity"] = model.clip->identity;
  json["known_words"] = model.vocabulary.known();
  json["bounds"] = numbers_of(model.bounds);
  return json.dump();
}

/// Copies every stored tensor onto its place; all places must be met, with the same shape.
void copy_tensors(const Container& container, std::map<std::string, torch::Tensor> places) {
  const torch::NoGradGuard no_grad;
  for (const NamedTensor& stored : container.tensors) {
    const auto place = places.find(stored.name);
    if (place == places.end()) throw std::invalid_argument("tensor '" + stored.name + "' belongs nowhere");
    if (place->second.sizes() != stored.tensor.sizes() || stored.tensor.scalar_type() != torch::kFloat32)
      throw std::invalid_argument("tensor '" + stored.name + "' has another shape or type");
    if (!torch::isfinite(stored.tensor).all().item<bool>())
      throw std::invalid_argument("tensor '" + stored.name + "' holds numbers that are not finite");
    place->second.copy_(stored.tensor);
    places.erase(place);
  }
  if (!places.empty()) throw std::invalid_argument("tensor '" + places.begin()->first + "' is missing");
}

std::map<std::string, torch::Tensor> places_of(const Model& model, const AdamW& optimizer) {
  std::map<std::string, torch::Tensor> places = optimizer.state();
  for (const auto& item : model.network->named_parameters())
    places["weights/" + item.key()] = item.value().detach();
  return places;
}

}  // namespace

std::unique_ptr<AdamW> make_optimizer(const Model& model, const TrainRates& rates) {
  FlowRamNetwork network = model.network;  // a shared handle
  return std::make_unique<AdamW>(*network, optimizer_options(rates));
}

void write_checkpoint(const std::filesystem::path& file, const Model& model, const AdamW& optimizer,
                      const TrainProgress& progress) {
  Container container;
  container.text["policy"] = header_of(model, progress);
  for (const auto& [name, tensor] : places_of(model, optimizer))
    container.tensors.push_back({name, tensor.cpu().contiguous()});
  write_container(file, container);
}

LoadedCheckpoint read_checkpoint(const std::filesystem::path& file, const torch::Device& device) {
  const Container container = read_container(file);
  try {
    const auto text = container.text.find("policy");
    if (text == container.text.end()) throw std::invalid_argument("the text 'policy' is missing");
    const Json json = Json::parse(text->second);
    Model read;
    TrainProgress progress;
    visit_header(read, progress, [&json](const char* name, auto& value) { json.at(name).get_to(value); });
    // Before there were kinds of augmentation there was one switch.
    if (json.contains("augment") && !json.at("augment").get<bool>())
      progress.options.augment = Augmentation::none();
    visit_later(read, progress, [&json](const char* name, auto& value) {
      if (json.contains(name)) json.at(name).get_to(value);
    });
    require_sane(read.shape);
    progress.options.radius = read.radius.kind;
    progress.options.backbone = read.backbone;
    progress.options.objective = read.objective_name;
    progress.options.grounded = read.shape.grounded;
    progress.options.point_encoder = read.shape.point_encoder;
    progress.options.binding = read.shape.binding;
    progress.options.times = progress.rates.times;
    progress.options.scenes = progress.rates.scenes;
    const auto clip = clip_for(read.shape, progress.options.clip);
    if (clip && clip->identity != json.at("clip_identity").get<std::string>())
      throw std::invalid_argument("was trained on other CLIP weights than " + progress.options.clip);
    LoadedCheckpoint loaded{make_model(read.shape, read.radius, read.backbone, read.objective_name, 0, clip),
                            nullptr, std::move(progress)};
    loaded.model.vocabulary.restore(json.at("known_words").get<std::vector<std::string>>());
    loaded.model.bounds = box_of(json.at("bounds").get<std::vector<double>>());
    loaded.model.scale = PositionScale::from_bounds(loaded.model.bounds);
    loaded.model.objective = make_objective(read.objective_name, loaded.progress.rates.times);
    loaded.model.network->to(device);
    loaded.optimizer = make_optimizer(loaded.model, loaded.progress.rates);
    loaded.optimizer->steps = loaded.progress.optimizer_steps;
    copy_tensors(container, places_of(loaded.model, *loaded.optimizer));
    return loaded;
  } catch (const std::exception& e) {
    throw BadCheckpoint(file.string() + ": " + e.what());
  }
}

std::string weights_sha256(const Model& model) {
  std::vector<std::uint8_t> bytes;
  for (const auto& item : model.network->named_parameters()) {
    bytes.insert(bytes.end(), item.key().begin(), item.key().end());
    const torch::Tensor t = item.value().detach().cpu().contiguous();
    const auto* first = static_cast<const std::uint8_t*>(t.data_ptr());
    bytes.insert(bytes.end(), first, first + t.nbytes());
  }
  return sha256_hex(bytes);
}

}  // namespace flowscope
