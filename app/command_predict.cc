// flowscope predict: one keyframe of a stored demonstration, with the whole flow written down.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "app/scene_input.h"
#include "app/trace_store.h"
#include "policy/policy.h"
#include "recorder/demo_store.h"
#include "recorder/utc_time.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

struct PredictCall {
  std::filesystem::path policy, trace;
  std::string demo;
  int keyframe = 0, flow_steps = 4, samples = 1;
  std::uint64_t seed = 0;
  std::string integrator = "euler";
};

int predict(const PredictCall& call, const Context& context) {
  const DemoStore store(existing_data(context));
  Demo demo;
  PolicyInput input;
  try {
    demo = store.load(call.demo);
    input = input_of(demo, call.keyframe);
  } catch (const std::out_of_range& error) {
    throw UsageError(error.what());
  }
  PredictOptions options;
  options.flow_steps = call.flow_steps;
  options.seed = call.seed;
  options.integrator = call.integrator;
  std::vector<FlowTrace> traces;
  try {
    traces = load_policy(call.policy)->predict_samples(input, options, call.samples);
  } catch (const std::invalid_argument& error) {  // an integrator that the objective does not take
    throw UsageError(error.what());
  }
  for (FlowTrace& trace : traces) {
    trace.id = call.demo + "-k" + std::to_string(call.keyframe) + "-s" + std::to_string(trace.seed);
    trace.created = utc_now();
    trace.policy_file = call.policy.string();
    trace.scene.task = demo.info.task;
    trace.scene.variation = demo.info.variation;
    trace.scene.seed = demo.info.seed;
    trace.scene.demo = demo.info.id;
    trace.scene.keyframe = call.keyframe;
    const int frame = call.keyframe == 0 ? 0 : demo.keyframes[call.keyframe - 1].frame;
    trace.scene.state_sha256 = state_sha256(demo.frames[frame].state);
    compare_with_expert(trace, demo.keyframes[call.keyframe].action);
  }
  write_trace_file(call.trace, traces);
  if (context.json) {
    web::wire::Json document = web::wire::Json::array();
    for (const auto& trace : traces) document.push_back(web::wire::to_json(trace));
    print_json(traces.size() == 1 ? document[0] : document);
  } else {
    for (const auto& trace : traces) {
      std::printf("seed %llu: %.1f mm and %.2f degrees from the expert, gripper %s\n",
                  static_cast<unsigned long long>(trace.seed), trace.error->position_m * 1000,
                  trace.error->rotation_deg, trace.error->open_correct ? "right" : "wrong");
    }
  }
  return 0;
}

}  // namespace

void add_predict_command(CLI::App& root, Context& context) {
  CLI::App* command =
      root.add_subcommand("predict", "Predict a keyframe of a demonstration and write the flow trace");
  auto call = std::make_shared<PredictCall>();
  command->add_option("--policy", call->policy, "Trained policy")->required();
  add_data_option(*command, context);
  command->add_option("--demo", call->demo, "Demonstration id")->required();
  command->add_option("--keyframe", call->keyframe, "Which keyframe to predict, from 0")->required();
  command->add_option("--flow-steps", call->flow_steps, "Steps of the flow")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--integrator", call->integrator, "How a step follows the flow; diffusion has its own")
      ->check(CLI::IsMember({"euler", "midpoint", "rk4"}))
      ->capture_default_str();
  command->add_option("--samples", call->samples, "Predictions from seed, seed + 1, …")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--seed", call->seed, "Seed of the noise")->capture_default_str();
  command->add_option("--trace", call->trace, "File to write")->required();
  add_json_option(*command, context);
  set_body(*command, context, [call, &context] { return predict(*call, context); });
}

}  // namespace flowscope::app
