#include "policy/training_set.h"

#include <algorithm>
#include <stdexcept>

namespace flowscope {

void TrainingSet::add(Model& model, const Demo& demo, bool held_out) {
  if (demo.keyframes.empty())
    throw std::invalid_argument("demonstration " + demo.info.id + " has no keyframes");
  model.vocabulary.learn(demo.info.instruction);
  for (const std::string& text : demo.instructions) model.vocabulary.learn(text);
  Entry entry{demo.info.id, held_out, demo, {}};
  if (frozen_) prepare(model, entry);
  const auto it =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.id == entry.id; });
  if (it != entries_.end())
    *it = std::move(entry);
  else
    entries_.push_back(std::move(entry));
}

void TrainingSet::remove(const std::string& id) {
  std::erase_if(entries_, [&](const Entry& e) { return e.id == id; });
}

void TrainingSet::freeze(Model& model) {
  if (frozen_) return;
  if (entries_.empty()) throw std::invalid_argument("there is no demonstration to learn from");
  Box all = entries_.front().waiting.bounds;
  for (const Entry& e : entries_) {
    all.min = all.min.cwiseMin(e.waiting.bounds.min);
    all.max = all.max.cwiseMax(e.waiting.bounds.max);
  }
  model.bounds = all;
  model.scale = PositionScale::from_bounds(all);
  for (Entry& e : entries_) prepare(model, e);
  frozen_ = true;
}

void TrainingSet::prepare(const Model& model, Entry& entry) {
  entry.samples = samples_of(entry.waiting, model.bounds, model.shape, model.vocabulary);
  entry.waiting = Demo{};
}

const Sample& TrainingSet::draw(Random& random) const {
  std::size_t count = 0;
  for (const Entry& e : entries_)
    if (!e.held_out) count += e.samples.size();
  if (count == 0) throw std::invalid_argument("every demonstration is held out: there is none to learn from");
  auto at = static_cast<std::size_t>(random.below(static_cast<int>(count)));
  for (const Entry& e : entries_) {
    if (e.held_out) continue;
    if (at < e.samples.size()) return e.samples[at];
    at -= e.samples.size();
  }
  throw std::logic_error("drew beyond the last sample");
}

std::vector<const Sample*> TrainingSet::held_out() const {
  std::vector<const Sample*> out;
  for (const Entry& e : entries_)
    if (e.held_out)
      for (const Sample& s : e.samples) out.push_back(&s);
  return out;
}

}  // namespace flowscope
