#include "policy/training_set.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace flowscope {

void TrainingSet::add(Model& model, const Demo& demo, bool held_out) {
  if (demo.keyframes.empty())
    throw std::invalid_argument("demonstration " + demo.info.id + " has no keyframes");
  model.vocabulary.learn(demo.info.instruction);
  for (const std::string& text : demo.instructions) model.vocabulary.learn(text);
  Entry entry{demo.info.id, demo.info.task, held_out, demo.bounds, demo, {}};
  if (frozen_) prepare(model, entry);
  const auto it =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.id == entry.id; });
  if (it != entries_.end())
    *it = std::move(entry);
  else
    entries_.push_back(std::move(entry));
  sort_by_task();
}

void TrainingSet::remove(const std::string& id) {
  std::erase_if(entries_, [&](const Entry& e) { return e.id == id; });
  sort_by_task();
}

void TrainingSet::freeze(Model& model) {
  if (frozen_) return;
  if (entries_.empty()) throw std::invalid_argument("there is no demonstration to learn from");
  Box all = entries_.front().bounds;
  for (const Entry& e : entries_) {
    all.min = all.min.cwiseMin(e.bounds.min);
    all.max = all.max.cwiseMax(e.bounds.max);
  }
  model.bounds = all;
  model.scale = PositionScale::from_bounds(all);
  for (Entry& e : entries_) prepare(model, e);
  sort_by_task();
  frozen_ = true;
}

void TrainingSet::prepare(const Model& model, Entry& entry) {
  entry.samples = samples_of(entry.waiting, model.bounds, model.shape, model.vocabulary, keep_observations_);
  entry.waiting = Demo{};
}

void TrainingSet::sort_by_task() {
  training_.clear();
  held_out_.clear();
  for (const Entry& e : entries_)
    for (const Sample& s : e.samples) (e.held_out ? held_out_ : training_)[e.task].push_back(&s);
}

const Sample& TrainingSet::draw(Random& random) const {
  if (training_.empty())
    throw std::invalid_argument("every demonstration is held out: there is none to learn from");
  const auto task = std::next(training_.begin(), random.below(static_cast<int>(training_.size())));
  const std::vector<const Sample*>& samples = task->second;
  return *samples[static_cast<std::size_t>(random.below(static_cast<int>(samples.size())))];
}

std::string TrainingSet::fingerprint() const {
  std::ostringstream out;
  out.precision(17);
  for (const Entry& e : entries_)
    out << e.id << (e.held_out ? " held out " : " ") << e.bounds.min.transpose() << " "
        << e.bounds.max.transpose() << "\n";
  return out.str();
}

}  // namespace flowscope
