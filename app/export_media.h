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

/// Each of them looks at `stop` every few tens of milliseconds: then it throws web::ApiError 409, and no file
/// appears.

/// One picture of `state` with `overlay`.
void export_png(const TaskLibrary& tasks, const SceneState& state, const web::ViewSettings& view,
                const Overlay& overlay, const std::filesystem::path& file, std::stop_token stop = {});
/// The flow, step by step, each held for half a second and the last for a second and a half; 30 frames/s.
/// `view.detectors` draws what the success terms of its scene watch.
void export_trace_mp4(const TaskLibrary& tasks, const SceneState& state, const FlowTrace& trace,
                      const web::ViewSettings& view, const std::filesystem::path& file,
                      const Progress& progress, std::stop_token stop);
/// A demonstration re-drawn from its stored states at 20 frames/s; `view.detectors` draws what its success
/// terms watch.
void export_demo_mp4(const TaskLibrary& tasks, const Demo& demo, const web::ViewSettings& view,
                     const std::filesystem::path& file, const Progress& progress, std::stop_token stop);

/// More pictures make no figure, and take memory before they are one.
inline constexpr std::size_t strip_most_steps = 150;
/// All steps of the flow side by side, as papers show them; `view` is the size of each picture. Throws
/// std::invalid_argument when there are more than `strip_most_steps`.
void export_strip(const TaskLibrary& tasks, const SceneState& state, const FlowTrace& trace,
                  const web::ViewSettings& view, const std::filesystem::path& file, std::stop_token stop);
/// A trace file says how many points lie in each region, not which: finds them again in its scene, one per
/// centimetre, to draw.
void find_points_inside(const TaskLibrary& tasks, const SceneState& state, FlowTrace& trace);
/// What the four cameras see as a coloured cloud in the world frame, PLY or PCD by the file's ending; with
/// `leaf_m` > 0 one point per cube of that side. Throws std::invalid_argument for another ending.
void export_cloud(const TaskLibrary& tasks, const SceneState& state, double leaf_m,
                  const std::filesystem::path& file, std::stop_token stop = {});

}  // namespace flowscope
