// The demonstrations that a trainer knows, prepared.
#pragma once

#include <string>
#include <vector>

#include "policy/model.h"

namespace flowscope {

/// Until `freeze` the demonstrations wait, because the bounds that normalise positions are the union of
/// theirs; after it they are prepared as they come. Order of adding is kept: with the same order and seed the
/// same batches are drawn.
class TrainingSet {
 public:
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
  /// A random training keyframe. Throws std::invalid_argument when all are held out.
  const Sample& draw(Random& random) const;
  std::vector<const Sample*> held_out() const;

 private:
  struct Entry {
    std::string id;
    bool held_out = false;
    Demo waiting;  ///< emptied once prepared
    std::vector<Sample> samples;
  };
  void prepare(const Model& model, Entry& entry);

  std::vector<Entry> entries_;
  bool frozen_ = false;
};

}  // namespace flowscope
