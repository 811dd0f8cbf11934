// flowscope export png|mp4: figures and films of a demonstration or of a flow trace, without a server.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/cli.h"
#include "app/commands.h"
#include "app/export_media.h"
#include "app/scene_input.h"
#include "app/trace_overlay.h"
#include "recorder/demo_store.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

struct ExportCall {
  std::filesystem::path out, trace;
  std::string demo, camera = "free";
  int frame = -1, step = -1, width = 1280, height = 960;
};

/// A trace file holds numbers, not the world: its scene is the demonstration's at the keyframe, or a reset of
/// its seed.
SceneState scene_of(const TaskLibrary& tasks, const DemoStore& store, const FlowTrace& trace) {
  if (trace.scene.demo) {
    const Demo demo = store.load(*trace.scene.demo);
    const int k = trace.scene.keyframe.value_or(0);
    const int frame = k == 0 ? 0 : demo.keyframes.at(k - 1).frame;
    return demo.frames.at(frame).state;
  }
  if (trace.scene.keyframe.value_or(0) > 0) {
    throw UsageError(
        "--trace: this prediction was made in the middle of a live episode; export it from the page");
  }
  World world(tasks.get(trace.scene.task));
  world.reset(trace.scene.variation, trace.scene.seed);
  return world.state();
}

FlowTrace read_trace(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw UsageError("--trace " + file.string() + ": cannot be read");
  std::stringstream text;
  text << in.rdbuf();
  try {
    auto json = web::wire::Json::parse(text.str());
    return web::wire::trace_from_json(json.is_array() ? json.at(0) : json);
  } catch (const std::exception& error) {
    throw UsageError(file.string() + ": " + error.what());
  }
}

int export_file(const ExportCall& call, bool film, const Context& context) {
  const TaskLibrary tasks(find_assets());
  const DemoStore store(context.data);
  web::ViewSettings view;
  if (call.camera != "free") view.camera = call.camera;
  view.width = call.width;
  view.height = call.height;
  if (call.demo.empty() == call.trace.empty())
    throw UsageError("--demo or --trace says what to draw (one of them)");
  const Progress quiet = [](double) {};
  if (!call.trace.empty()) {
    const FlowTrace trace = read_trace(call.trace);
    const SceneState state = scene_of(tasks, store, trace);
    const int step = call.step < 0 ? trace.flow_steps : call.step;
    if (step > trace.flow_steps)
      throw UsageError("--step: the trace has steps 0 to " + std::to_string(trace.flow_steps));
    if (film) {
      export_trace_mp4(tasks, state, trace, view, call.out, quiet, {});
    } else {
      export_png(tasks, state, view, overlay_of(trace, step), call.out);
    }
  } else {
    Demo demo;
    try {
      demo = store.load(call.demo);
    } catch (const std::out_of_range& error) {
      throw UsageError(error.what());
    }
    const int last = static_cast<int>(demo.frames.size()) - 1;
    if (call.frame > last)
      throw UsageError("--frame: the demonstration has frames 0 to " + std::to_string(last));
    if (film) {
      export_demo_mp4(tasks, demo, view, call.out, quiet, {});
    } else {
      export_png(tasks, demo.frames[call.frame < 0 ? last : call.frame].state, view, {}, call.out);
    }
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
  const bool film = kind == "mp4";
  auto call = std::make_shared<ExportCall>();
  command->add_option("--out", call->out, "File to write")->required();
  add_data_option(*command, context);
  command->add_option("--demo", call->demo, "Demonstration id");
  command->add_option("--trace", call->trace, "Trace file written by predict or serve");
  command->add_option("--camera", call->camera, "Point of view")
      ->check(CLI::IsMember({"free", "front", "left_shoulder", "right_shoulder", "wrist"}))
      ->capture_default_str();
  if (!film) {
    command->add_option("--frame", call->frame, "Frame of the demonstration; the last by default")
        ->check(CLI::NonNegativeNumber);
    command->add_option("--step", call->step, "Step of the trace; the last by default")
        ->check(CLI::NonNegativeNumber);
  }
  command->add_option("--width", call->width, "Pixels")->check(CLI::Range(64, 3840))->capture_default_str();
  command->add_option("--height", call->height, "Pixels")->check(CLI::Range(64, 2160))->capture_default_str();
  add_json_option(*command, context);
  set_body(*command, context, [call, film, &context] { return export_file(*call, film, context); });
}

}  // namespace

void add_export_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("export", "Write a figure or a film");
  command->require_subcommand(1);
  add_kind(*command, context, "png", "One picture of a demonstration or of a step of a flow");
  add_kind(*command, context, "mp4", "A demonstration, or a flow step by step, as H.264");
}

}  // namespace flowscope::app
