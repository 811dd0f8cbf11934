// What success terms watch, as things to draw.
#pragma once

#include <vector>

#include "policy/flow_trace.h"
#include "recorder/demo.h"
#include "recorder/success_term.h"
#include "recorder/task.h"
#include "recorder/world.h"
#include "render/overlay.h"

namespace flowscope {

/// Boxes, spheres and ways in the colours of met and unmet, each with its term's name. Terms that watch the
/// same volume share it: it is met as soon as one of them is, and its label counts them.
Overlay overlay_of(const std::vector<Detector>& detectors);

/// Of a demonstration at a frame, with what its terms have latched until then.
Overlay detectors_of(const TaskLibrary& tasks, const Demo& demo, std::size_t frame);
/// Of the scene that a prediction was made in; what had been latched there is not known.
Overlay detectors_of(const TaskLibrary& tasks, const FlowTrace& trace, const SceneState& state);
/// Both drawn.
Overlay together(Overlay first, Overlay second);

/// The detectors of a recorded episode: a world apart that is taken from state to state.
class DetectorReplay {
 public:
  DetectorReplay(std::shared_ptr<const Task> task, int variation, std::uint64_t seed);
  /// States in the order of time: what terms latch on the way stays.
  Overlay at(const SceneState& state);

 private:
  World world_;
};

}  // namespace flowscope
