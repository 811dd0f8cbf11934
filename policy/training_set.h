// The demonstrations that a trainer knows, prepared.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "policy/model.h"

namespace flowscope {

/// Until `freeze` the demonstrations wait, because the bounds that normalise positions are the union of
/// theirs; after it they are prepared as they come. Order of adding is kept: with the same order and seed the
/// same batches are drawn.
class TrainingSet {
 public:
  /// With `keep_observations` samples keep their pictures, half a megabyte each, so that they can be cropped.
  explicit TrainingSet(bool keep_observations = false) : keep_observations_(keep_observations) {}

  /// Learns the instruction's words into `model`. Adding an id again replaces it. Throws
  /// std::invalid_argument.
  void add(Model& model, const Demo& demo, bool held_out);
  void remove(const std::string& id);
  /// Fixes bounds and scale in `model` from what was added. Throws std::invalid_argument when there is
  /// nothing.
  void freeze(Model& model);
  /// For a model whose bounds came with its weights.
  void set_frozen() { frozen_ = true; }
  bool frozen() const { return frozen_; }

  int demos() const { return static_cast<int>(entries_.size()); }
  /// A random training keyframe: first a task, every one as likely, then one of its keyframes, so that a task
  /// of few or short demonstrations is not drowned. Throws std::invalid_argument when all are held out.
  const Sample& draw(Random& random) const;
  /// By task.
  const std::map<std::string, std::vector<const Sample*>>& held_out() const { return held_out_; }
  /// Ids in order, which are held out, and bounds as given: equal for sets that give the same batches.
  std::string fingerprint() const;

 private:
  struct Entry {
    std::string id, task;
    bool held_out = false;
    Box bounds;
    Demo waiting;  ///< emptied once prepared
    std::vector<Sample> samples;
  };
  void prepare(const Model& model, Entry& entry);
  void sort_by_task();

  bool keep_observations_ = false, frozen_ = false;
  std::vector<Entry> entries_;
  std::map<std::string, std::vector<const Sample*>> training_, held_out_;  ///< samples in `entries_`
};

}  // namespace flowscope
