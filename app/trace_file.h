// Flow traces in files, and the scenes that they were predicted in.
#pragma once

#include <filesystem>
#include <vector>

#include "policy/flow_trace.h"
#include "recorder/demo_store.h"
#include "recorder/task.h"
#include "render/scene_state.h"

namespace flowscope::app {

/// One trace or several samples of one prediction, as write_trace_file makes them. A file may come from
/// anywhere, so its size, depth and every value are bounded. Throws UsageError that names the file and the
/// place in it ("trace.json: steps[3].pose.quaternion: …").
std::vector<FlowTrace> read_trace_file(const std::filesystem::path& file);

/// A trace file holds numbers, not the world: its scene is the demonstration's at the keyframe, or a reset of
/// its seed. Throws UsageError that names the file and the place when there is no such scene, or the
/// demonstration's is another one; that a reset gives another one is said on stderr, for another machine may
/// round otherwise.
SceneState scene_of_trace(const TaskLibrary& tasks, const DemoStore& store, const FlowTrace& trace,
                          const std::filesystem::path& file);

}  // namespace flowscope::app
