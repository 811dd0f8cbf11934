// flowscope train: learns from a data folder until the steps or the minutes are over, or until it is
// interrupted. Under mpirun all processes learn together, and the first one writes and speaks.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "app/data_lock.h"
#include "app/mpi_exchange.h"
#include "app/training_set.h"
#include "policy/one_robot.h"
#include "policy/trainer.h"
#include "recorder/demo_store.h"

namespace flowscope::app {
namespace {

struct TrainCall {
  std::filesystem::path policy;
  std::vector<std::string> tasks;
  std::int64_t steps = 0;
  double minutes = 0;
  bool resume = false, unfinished = false, paper_form = false, no_augment = false;
  std::string point_encoder = "on", binding = "on", part_middles = "on", augment = "default";
  TrainOptions options;
};

std::atomic<bool> interrupted{false};  // set by a signal handler, which can reach nothing else

bool any_interrupted(GradientExchange& exchange) {
  float count = interrupted ? 1 : 0;
  exchange.sum(&count, 1);
  return count > 0;
}

TrainingChoice choose_demonstrations(const Trainer& trainer, const DemoStore& store, const TrainCall& call) {
  try {
    TrainingChoice choice = choose_training(store.list(), call.tasks, call.unfinished);
    require_same_robot(trainer.robot(), choice.robot);
    return choice;
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--tasks: ") + error.what());
  }
}

void add_demonstrations(Trainer& trainer, const DemoStore& store, const TrainingChoice& choice) {
  std::map<std::string, std::size_t> position;
  for (const DemoInfo& info : choice.demos)
    trainer.add(store.load_keyframes(info.id), held_out(position[info.task]++));
}

TrainOptions options_of(const TrainCall& call) {
  TrainOptions options = call.options;
  options.expected_minutes = call.minutes;
  options.expected_steps = call.steps;
  options.grounded = !call.paper_form;
  options.augment = call.no_augment ? Augmentation::none() : augmentation_of(call.augment);
  options.point_encoder = call.point_encoder == "on";
  options.binding = call.binding == "on";
  options.part_middles = call.part_middles == "on";
  return options;
}

std::unique_ptr<Trainer> make_trainer(const TrainCall& call,
                                      const std::shared_ptr<GradientExchange>& exchange) {
  try {
    return call.resume ? Trainer::resume(call.policy, call.options.device, exchange)
                       : Trainer::create(options_of(call), exchange);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

void tell_progress(const TrainStatus& now) {
  std::fprintf(
      stderr, "%7.1f min  step %6lld  loss %.4f  (position %.4f, rotation %.4f, open %.4f)  %.0f samples/s\n",
      now.minutes, static_cast<long long>(now.step), now.loss, now.loss_position, now.loss_rotation,
      now.loss_open, now.samples_per_s);
}

nlohmann::ordered_json validation_json(const Validation& v) {
  nlohmann::ordered_json tasks = nlohmann::ordered_json::array();
  for (const TaskError& t : v.tasks)
    tasks.push_back({{"task", t.task},
                     {"position_mm", t.position_mm},
                     {"rotation_deg", t.rotation_deg},
                     {"keyframes", t.keyframes}});
  return {{"position_mm", v.position_mm},
          {"rotation_deg", v.rotation_deg},
          {"keyframes", v.keyframes},
          {"tasks", tasks}};
}

void tell_result(const TrainStatus& now, const std::filesystem::path& policy, int processes, bool json) {
  if (json) {
    print_json({{"steps", now.step},
                {"minutes", now.minutes},
                {"loss", now.loss},
                {"loss_position", now.loss_position},
                {"loss_rotation", now.loss_rotation},
                {"loss_open", now.loss_open},
                {"skipped", now.skipped},
                {"validation", validation_json(now.validation)},
                {"samples_per_s", now.samples_per_s},
                {"processes", processes},
                {"policy", policy.string()}});
    return;
  }
  const Validation& v = now.validation;
  std::printf(
      "%lld steps in %.1f minutes, loss %.4f, held-out error %.1f mm and %.2f degrees (%d keyframes): %s\n",
      static_cast<long long>(now.step), now.minutes, now.loss, v.position_mm, v.rotation_deg, v.keyframes,
      policy.c_str());
  for (const TaskError& t : v.tasks)
    std::printf("  %-28s %6.1f mm  %6.2f degrees  (%d keyframes)\n", t.task.c_str(), t.position_mm,
                t.rotation_deg, t.keyframes);
}

int train_with(const TrainCall& call, const Context& context,
               const std::shared_ptr<GradientExchange>& exchange) {
  if (call.steps <= 0 && call.minutes <= 0) throw UsageError("--steps or --minutes says how long to train");
  const bool first = exchange->rank() == 0;
  const DemoStore store(existing_data(context));
  const auto trainer = make_trainer(call, exchange);
  const TrainingChoice choice = choose_demonstrations(*trainer, store, call);
  if (choice.demos.empty()) {
    throw UsageError("--data " + context.data.string() + ": no demonstrations to learn from" +
                     (choice.unfinished > 0 ? " but unfinished ones (--unfinished)" : ""));
  }
  add_demonstrations(*trainer, store, choice);
  const auto lock = first ? std::optional(lock_policy(call.policy, "train")) : std::nullopt;
  if (first) std::fprintf(stderr, "training on %zu demonstrations\n", choice.demos.size());
  if (first && choice.unfinished > 0)
    std::fprintf(stderr, "%d unfinished ones left out (--unfinished takes them)\n", choice.unfinished);
  if (first && exchange->size() > 1) std::fprintf(stderr, "in %d processes\n", exchange->size());

  std::signal(SIGINT, [](int) { interrupted = true; });
  std::signal(SIGTERM, [](int) { interrupted = true; });
  // Steps and minutes are the same on every rank, so all do the same here.
  TrainStatus now = trainer->status();
  // --minutes counts the whole: more of them than before stretch the schedule, the same leave it as it was.
  if (call.resume && call.minutes > now.minutes) trainer->go_on_for(call.minutes - now.minutes);
  const std::int64_t first_step = now.step;
  double told = now.minutes, saved = now.minutes;
  while (!any_interrupted(*exchange)) {
    now = trainer->step();
    if (first && now.minutes - told >= 0.25) {
      told = now.minutes;
      tell_progress(now);
    }
    if (now.minutes - saved >= 1) {
      saved = now.minutes;
      trainer->require_agreement();
      if (first) trainer->save(call.policy);
    }
    if (call.steps > 0 && now.step - first_step >= call.steps) break;
    if (call.minutes > 0 && now.minutes >= call.minutes) break;
  }
  trainer->require_agreement();
  if (!first) return 0;
  now.validation = trainer->validate();
  trainer->save(call.policy);
  tell_result(now, call.policy, exchange->size(), context.json);
  return 0;
}

int exit_code_of(const std::exception& error) {
  const bool wrong_call = dynamic_cast<const UsageError*>(&error) || dynamic_cast<const BadDemo*>(&error) ||
                          dynamic_cast<const BadCheckpoint*>(&error);
  return wrong_call ? 2 : 1;
}

int train(const TrainCall& call, const Context& context) {
  if (!started_by_mpi()) return train_with(call, context, std::make_shared<SingleProcess>());
  const auto exchange = std::make_shared<MpiExchange>();
  try {
    return train_with(call, context, exchange);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "flowscope: process %d of %d: %s\n", exchange->rank(), exchange->size(),
                 error.what());
    exchange->abort(exit_code_of(error));
  }
}

void add_method_options(CLI::App& command, TrainCall& call) {
  const auto choice = [&command](const char* name, std::string& value, std::vector<std::string> of,
                                 const char* text) {
    command.add_option(name, value, text)->check(CLI::IsMember(std::move(of)))->capture_default_str();
  };
  const std::vector<std::string> switched{"on", "off"};
  choice("--preset", call.options.preset, {"nano", "desk", "paper"}, "Size of the network");
  choice("--objective", call.options.objective, {"cfm", "ddim", "ddpm"}, "Noise path and target");
  choice("--backbone", call.options.backbone, {"mamba", "transformer"}, "Sequence model");
  choice("--radius", call.options.radius, {"linear", "cosine", "off"}, "Dynamic Radius Schedule");
  choice("--point-encoder", call.point_encoder, switched, "Mamba point encoder");
  choice("--binding", call.binding, switched, "Points are compared with the words before anything is pooled");
  choice("--part-middles", call.part_middles, switched,
         "Small like-coloured parts have one middle, their outline's");
  command
      .add_option("--image-branch", call.options.image_branch,
                  "Features of the image tokens: patches (learnt here) or clip; without it the preset's")
      ->check(CLI::IsMember({"patches", "clip"}));
  command
      .add_option("--text-branch", call.options.text_branch,
                  "Features of the words: words (learnt here) or clip; without it the preset's")
      ->check(CLI::IsMember({"words", "clip"}));
  command.add_option("--clip", call.options.clip,
                     "CLIP's weights as policy convert wrote them, for the branches that say clip");
  command.add_option("--times", call.options.times,
                     "Training times of flow matching: logit_normal, logit_normal_unit, uniform, beta; "
                     "without it the preset's");
  command.add_flag("--paper-form", call.paper_form,
                   "The paper's own parameterisation: velocity from the action token");
  CLI::Option* augment =
      command
          .add_option("--augment", call.augment,
                      "How demonstrations are varied: default (all but crop), none, or some of move, "
                      "recolor, repaint, "
                      "shuffle, crop (the paper's crops of the pictures) with commas between")
          ->capture_default_str();
  command.add_flag("--no-augment", call.no_augment, "The same as --augment none")->excludes(augment);
}

}  // namespace

void add_train_command(CLI::App& root, Context& context) {
  CLI::App* command = root.add_subcommand("train", "Train a policy on the demonstrations of a data folder");
  auto call = std::make_shared<TrainCall>();
  add_data_option(*command, context);
  command->add_option("--policy", call->policy, "File of the policy: written every minute and at the end")
      ->required();
  command->add_option("--tasks", call->tasks, "Only demonstrations of these tasks")->delimiter(',');
  command->add_flag("--unfinished", call->unfinished,
                    "Learn from demonstrations that were saved without success, too");
  command->add_option("--steps", call->steps, "Optimiser steps to take")->check(CLI::PositiveNumber);
  command->add_option("--minutes", call->minutes, "Minutes to train")->check(CLI::PositiveNumber);
  command->add_flag("--resume", call->resume, "Go on exactly where the policy file stopped");
  add_method_options(*command, *call);
  command
      ->add_option("--scenes", call->options.scenes,
                   "Observations per step and process; without it the preset's")
      ->check(CLI::PositiveNumber);
  command->add_option("--device", call->options.device, "Where to learn: cpu, cuda, cuda:1, …")
      ->capture_default_str();
  command->add_option("--seed", call->options.seed, "Seed of weights, batches and noise")
      ->capture_default_str();
  add_json_option(*command, context);
  set_body(*command, context, [call, &context] { return train(*call, context); });
}

}  // namespace flowscope::app
