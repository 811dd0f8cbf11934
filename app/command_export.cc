// flowscope export: figures, films and clouds of a demonstration or of a flow trace, without a server.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/cli.h"
#include "app/commands.h"
#include "app/detector_overlay.h"
#include "app/export_media.h"
#include "app/trace_file.h"
#include "app/trace_overlay.h"
#include "recorder/demo_store.h"
#include "render/new_file.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

struct ExportCall {
  std::vector<std::string> task_dirs;  ///< folders of further tasks
  std::filesystem::path out, trace;
  std::string demo, camera = "free";
  int frame = -1, step = -1, width = 1280, height = 960;
  double leaf_mm = 0;
  bool detectors = false;  ///< draw what success terms watch
};

/// What is drawn: a scene, and the trace or demonstration that it comes from.
struct Subject {
  SceneState state;
  std::vector<FlowTrace> traces;  ///< several: samples of one prediction
  std::optional<Demo> demo;
};

Subject subject_of(const ExportCall& call, const TaskLibrary& tasks, const DemoStore& store) {
  if (call.demo.empty() == call.trace.empty())
    throw UsageError("--demo or --trace says what to draw (one of them)");
  Subject subject;
  if (!call.trace.empty()) {
    subject.traces = read_trace_file(call.trace);
    subject.state = scene_of_trace(tasks, store, subject.traces.front(), call.trace);
    find_points_inside(tasks, subject.state, subject.traces.front());
    return subject;
  }
  try {
    subject.demo = store.load(call.demo);
  } catch (const std::out_of_range& error) {
    throw UsageError(error.what());
  }
  const int last = static_cast<int>(subject.demo->frames.size()) - 1;
  if (call.frame > last)
    throw UsageError("--frame: the demonstration has frames 0 to " + std::to_string(last));
  subject.state = subject.demo->frames[static_cast<std::size_t>(call.frame < 0 ? last : call.frame)].state;
  return subject;
}

Overlay overlay_at(const std::vector<FlowTrace>& traces, int step) {
  if (traces.empty()) return {};
  if (traces.size() > 1 && step < 0) return overlay_of_samples(traces);
  const FlowTrace& trace = traces.front();
  if (step > trace.flow_steps)
    throw UsageError("--step: the trace has steps 0 to " + std::to_string(trace.flow_steps));
  return overlay_of(trace, step < 0 ? trace.flow_steps : step);
}

Overlay detectors_at(const TaskLibrary& tasks, const Subject& what, int frame) {
  if (!what.demo) return detectors_of(tasks, what.traces.front(), what.state);
  const std::size_t last = what.demo->frames.size() - 1;
  return detectors_of(tasks, *what.demo, frame < 0 ? last : static_cast<std::size_t>(frame));
}

int export_file(const ExportCall& call, const std::string& kind, const Context& context) {
  const TaskLibrary tasks(find_assets(), {call.task_dirs.begin(), call.task_dirs.end()});
  const DemoStore store(context.data);
  web::ViewSettings view;
  if (call.camera != "free") view.camera = call.camera;
  view.width = call.width;
  view.height = call.height;
  view.detectors = call.detectors;
  const Subject what = subject_of(call, tasks, store);
  remove_stale_temporaries(call.out.parent_path());
  const Progress quiet = [](double) {};
  if (kind == "png") {
    Overlay overlay = overlay_at(what.traces, call.step);
    if (call.detectors) overlay = together(std::move(overlay), detectors_at(tasks, what, call.frame));
    export_png(tasks, what.state, view, overlay, call.out);
  } else if (kind == "cloud") {
    export_cloud(tasks, what.state, call.leaf_mm / 1000, call.out);
  } else if (kind == "strip") {
    if (what.traces.empty()) throw UsageError("--trace: a strip shows the steps of a flow");
    export_strip(tasks, what.state, what.traces.front(), view, call.out, {});
  } else if (!what.traces.empty()) {
    export_trace_mp4(tasks, what.state, what.traces.front(), view, call.out, quiet, {});
  } else {
    export_demo_mp4(tasks, *what.demo, view, call.out, quiet, {});
  }
  if (context.json) {
    print_json({{"path", call.out.string()}, {"bytes", std::filesystem::file_size(call.out)}});
  } else {
    std::printf("%s\n", call.out.c_str());
  }
  return 0;
}

void add_kind(CLI::App& parent, Context& context, const std::string& kind, const std::string& about) {
  CLI::App* command = parent.add_subcommand(kind, about);
  auto call = std::make_shared<ExportCall>();
  command->add_option("--out", call->out, "File to write")->required();
  add_data_option(*command, context);
  command->add_option("--demo", call->demo, "Demonstration id");
  command->add_option("--trace", call->trace, "Trace file written by predict or serve");
  command->add_option("--tasks", call->task_dirs, "Folder of further tasks")
      ->type_name("DIR")
      ->allow_extra_args(false);
  if (kind == "png" || kind == "cloud") {
    command->add_option("--frame", call->frame, "Frame of the demonstration; the last by default")
        ->check(CLI::NonNegativeNumber);
  }
  if (kind == "png") {
    command
        ->add_option("--step", call->step,
                     "Step of the trace; by default the last, or all samples of a file that holds several")
        ->check(CLI::NonNegativeNumber);
  }
  if (kind == "png" || kind == "mp4") {
    command->add_flag("--detectors", call->detectors, "Draw the volumes and ways that success terms watch");
  }
  if (kind == "cloud") {
    command->add_option("--leaf", call->leaf_mm, "Millimetres: one point per cube of this side; 0 keeps all")
        ->check(CLI::Range(0.0, 1000.0))
        ->capture_default_str();
  } else {
    if (kind == "strip") call->width = 480, call->height = 360;  // of each picture
    command->add_option("--camera", call->camera, "Point of view")
        ->check(CLI::IsMember({"free", "front", "left_shoulder", "right_shoulder", "wrist"}))
        ->capture_default_str();
    command->add_option("--width", call->width, "Pixels")->check(CLI::Range(64, 3840))->capture_default_str();
    command->add_option("--height", call->height, "Pixels")
        ->check(CLI::Range(64, 2160))
        ->capture_default_str();
  }
  add_json_option(*command, context);
  add_egl_option(*command, context);
  set_body(*command, context, [call, kind, &context] {
    try {
      return export_file(*call, kind, context);
    } catch (
        const std::invalid_argument& error) {  // an ending that no writer knows, a strip that is too large
      throw UsageError(error.what());
    }
  });
}

}  // namespace

void add_export_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("export", "Write a figure, a film or a cloud");
  command->require_subcommand(1);
  add_kind(*command, context, "png", "One picture of a demonstration or of a step of a flow");
  add_kind(*command, context, "mp4", "A demonstration, or a flow step by step, as H.264");
  add_kind(*command, context, "strip", "All steps of a flow side by side, PNG");
  add_kind(*command, context, "cloud", "What the cameras see as a coloured point cloud, PLY or PCD");
}

}  // namespace flowscope::app
