// Figures and films: drawn by a renderer of their own, so the live view goes on.
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include "policy/flow_trace.h"
#include "recorder/demo.h"
#include "recorder/task.h"
#include "render/renderer.h"
#include "render/scene_state.h"
#include "web/backend.h"

namespace flowscope {

/// Fraction done in [0, 1].
using Progress = std::function<void(double)>;

/// One picture of `state` with `overlay`.
void export_png(const TaskLibrary& tasks, const SceneState& state, const web::ViewSettings& view,
                const Overlay& overlay, const std::filesystem::path& file);
/// The flow, step by step, each held for half a second and the last for a second and a half; 30 frames/s.
void export_trace_mp4(const TaskLibrary& tasks, const SceneState& state, const FlowTrace& trace,
                      const web::ViewSettings& view, const std::filesystem::path& file,
                      const Progress& progress, std::stop_token stop);
/// A demonstration re-drawn from its stored states at 20 frames/s.
void export_demo_mp4(const TaskLibrary& tasks, const Demo& demo, const web::ViewSettings& view,
                     const std::filesystem::path& file, const Progress& progress, std::stop_token stop);

}  // namespace flowscope
