// flowscope train: learns from a data folder until the steps or the minutes are over, or until it is
// interrupted.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "app/training_set.h"
#include "policy/trainer.h"
#include "recorder/demo_store.h"

namespace flowscope::app {
namespace {

struct TrainCall {
  std::filesystem::path policy;
  std::vector<std::string> tasks;
  std::int64_t steps = 0;
  double minutes = 0;
  bool resume = false, paper_form = false, no_augment = false;
  std::string point_encoder = "on";
  TrainOptions options;
};

std::atomic<bool> interrupted{false};  // set by a signal handler, which can reach nothing else

int add_demonstrations(Trainer& trainer, const DemoStore& store, const std::vector<std::string>& tasks) {
  int added = 0;
  std::map<std::string, std::size_t> position;
  for (const auto& info : store.list()) {
    if (!tasks.empty() && std::ranges::find(tasks, info.task) == tasks.end()) continue;
    trainer.add(store.load_keyframes(info.id), held_out(position[info.task]++));
    ++added;
  }
  return added;
}

int train(const TrainCall& call, const Context& context) {
  if (call.steps <= 0 && call.minutes <= 0) throw UsageError("--steps or --minutes says how long to train");
  const DemoStore store(existing_data(context));
  TrainOptions options = call.options;
  options.expected_minutes = call.minutes;
  options.expected_steps = call.steps;
  options.grounded = !call.paper_form;
  options.augment = !call.no_augment;
  options.point_encoder = call.point_encoder == "on";
  std::unique_ptr<Trainer> trainer;
  try {
    trainer = call.resume ? Trainer::resume(call.policy) : Trainer::create(options);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  const int demos = add_demonstrations(*trainer, store, call.tasks);
  if (demos == 0) throw UsageError("--data " + context.data.string() + ": no demonstrations to learn from");
  std::fprintf(stderr, "training on %d demonstrations\n", demos);

  std::signal(SIGINT, [](int) { interrupted = true; });
  std::signal(SIGTERM, [](int) { interrupted = true; });
  TrainStatus now = trainer->status();
  const std::int64_t first = now.step;
  double told = now.minutes, saved = now.minutes;
  while (!interrupted) {
    now = trainer->step();
    if (now.minutes - told >= 0.25) {
      told = now.minutes;
      std::fprintf(stderr, "%7.1f min  step %6lld  loss %.4f  (flow %.4f, open %.4f)  %.0f samples/s\n",
                   now.minutes, static_cast<long long>(now.step), now.loss, now.loss_flow, now.loss_open,
                   now.samples_per_s);
    }
    if (now.minutes - saved >= 1) {
      saved = now.minutes;
      trainer->save(call.policy);
    }
    if (call.steps > 0 && now.step - first >= call.steps) break;
    if (call.minutes > 0 && now.minutes >= call.minutes) break;
  }
  now.validation = trainer->validate();
  trainer->save(call.policy);
  if (context.json) {
    print_json({{"steps", now.step},
                {"minutes", now.minutes},
                {"loss", now.loss},
                {"validation",
                 {{"position_mm", now.validation.position_mm},
                  {"rotation_deg", now.validation.rotation_deg},
                  {"keyframes", now.validation.keyframes}}},
                {"samples_per_s", now.samples_per_s},
                {"policy", call.policy.string()}});
  } else {
    std::printf(
        "%lld steps in %.1f minutes, loss %.4f, held-out error %.1f mm and %.2f degrees (%d keyframes): %s\n",
        static_cast<long long>(now.step), now.minutes, now.loss, now.validation.position_mm,
        now.validation.rotation_deg, now.validation.keyframes, call.policy.c_str());
  }
  return 0;
}

}  // namespace

void add_train_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("train", "Train a policy on the demonstrations of a data folder");
  auto call = std::make_shared<TrainCall>();
  add_data_option(*command, context);
  command->add_option("--policy", call->policy, "File of the policy: written every minute and at the end")
      ->required();
  command->add_option("--tasks", call->tasks, "Only demonstrations of these tasks")->delimiter(',');
  command->add_option("--preset", call->options.preset, "Size of the network")
      ->check(CLI::IsMember({"nano", "desk", "paper"}))
      ->capture_default_str();
  command->add_option("--steps", call->steps, "Optimiser steps to take")->check(CLI::PositiveNumber);
  command->add_option("--minutes", call->minutes, "Minutes to train")->check(CLI::PositiveNumber);
  command->add_flag("--resume", call->resume, "Go on exactly where the policy file stopped");
  command->add_option("--objective", call->options.objective, "Noise path and target")
      ->check(CLI::IsMember({"cfm", "ddim", "ddpm"}))
      ->capture_default_str();
  command->add_option("--backbone", call->options.backbone, "Sequence model")
      ->check(CLI::IsMember({"mamba", "transformer"}))
      ->capture_default_str();
  command->add_option("--radius", call->options.radius, "Dynamic Radius Schedule")
      ->check(CLI::IsMember({"linear", "cosine", "off"}))
      ->capture_default_str();
  command->add_option("--point-encoder", call->point_encoder, "Mamba point encoder")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  command->add_flag("--paper-form", call->paper_form,
                    "The paper's own parameterisation: velocity from the action token");
  command->add_flag("--no-augment", call->no_augment,
                    "No rotation, shift or recolouring of the demonstrations");
  command->add_option("--seed", call->options.seed, "Seed of weights, batches and noise")
      ->capture_default_str();
  add_json_option(*command, context);
  set_body(*command, context, [call, &context] { return train(*call, context); });
}

}  // namespace flowscope::app
