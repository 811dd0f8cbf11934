// One network several times over: shared weights, gradients of their own, so that cores share an optimiser
// step.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "policy/network.h"
#include "policy/part_crew.h"

namespace flowscope {

/// At desk size a product of matrices is too small for two cores; half a batch each is not. What comes out
/// depends on the number of replicas, never on the number of threads.
class Replicas {
 public:
  /// The first is `network` itself; the others read its weights, wherever they are changed in place.
  Replicas(const FlowRamNetwork& network, const NetworkShape& shape, const std::string& backbone, int count);
  int count() const { return static_cast<int>(networks_.size()); }
  /// Calls work(part, its network) for every part, at most `threads` at a time, each on one thread of
  /// torch's; then adds the gradients up in the order of the parts, in those of the first. Throws what a part
  /// threw.
  void run(int threads, const std::function<void(int part, FlowRamNetwork& network)>& work);

 private:
  std::vector<FlowRamNetwork> networks_;
  std::unique_ptr<PartCrew> crew_;
};

}  // namespace flowscope
