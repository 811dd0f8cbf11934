// flowscope train: learns from a data folder until the steps or the minutes are over, or until it is
// interrupted. Under mpirun all processes learn together, and the first one writes and speaks.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
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

TrainingChoice choose_demonstrations(const Trainer& trainer, const std::vector<DemoInfo>& stored,
                                     const TrainCall& call) {
  try {
    TrainingChoice choice = choose_training(stored, call.tasks, call.unfinished);
    require_same_robot(trainer.robot(), choice.robot);
    return choice;
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--tasks: ") + error.what());
  }
}

/// What the trainer has taken in, and what is wrong with the rest.
struct Taken {
  int unfinished = 0;  ///< left out, for nobody asked for them
  std::vector<DemoProblem> left_out;
};

/// Throws UsageError when nothing remains.
Taken take_demonstrations(Trainer& trainer, const TrainCall& call, const Context& context) {
  const DemoStore store(existing_data(context));
  Taken taken;
  const TrainingChoice choice = choose_demonstrations(trainer, store.list(&taken.left_out), call);
  taken.unfinished = choice.unfinished;
  for (DemoProblem& problem : TrainingIntake(store).add_all(trainer, choice.demos))
    taken.left_out.push_back(std::move(problem));
  if (trainer.status().demos > 0) return taken;
  std::string why = taken.unfinished > 0 ? " but unfinished ones (--unfinished)" : "";
  if (!taken.left_out.empty()) why += "; left out: " + taken.left_out.front().problem;
  throw UsageError("--data " + context.data.string() + ": no demonstrations to learn from" + why);
}

void tell_taken(const Trainer& trainer, const Taken& taken) {
  for (const DemoProblem& problem : taken.left_out)
    std::fprintf(stderr, "warning: left out: %s\n", problem.problem.c_str());
  std::fprintf(stderr, "training on %d demonstrations\n", trainer.status().demos);
  if (taken.unfinished > 0)
    std::fprintf(stderr, "%d unfinished ones left out (--unfinished takes them)\n", taken.unfinished);
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

void tell_resumed(const TrainStatus& now) {
  std::fprintf(stderr, "going on after %lld steps in %.1f minutes; --steps and --minutes count from here\n",
               static_cast<long long>(now.step), now.minutes);
}

/// The error of a prediction; null where nothing was held out to measure it on.
template <typename Errors>
nlohmann::ordered_json errors_json(const Errors& errors) {
  if (errors.keyframes == 0) return {{"position_mm", nullptr}, {"rotation_deg", nullptr}, {"keyframes", 0}};
  return {{"position_mm", errors.position_mm},
          {"rotation_deg", errors.rotation_deg},
          {"keyframes", errors.keyframes}};
}

nlohmann::ordered_json validation_json(const Validation& v) {
  nlohmann::ordered_json json = errors_json(v), tasks = nlohmann::ordered_json::array();
  for (const TaskError& t : v.tasks) {
    nlohmann::ordered_json task{{"task", t.task}};
    task.update(errors_json(t));
    tasks.push_back(std::move(task));
  }
  json["tasks"] = std::move(tasks);
  return json;
}

template <typename Errors>
std::string errors_text(const Errors& errors) {
  char text[100];
  std::snprintf(text, sizeof text, "%.1f mm and %.2f degrees (%d keyframes)", errors.position_mm,
                errors.rotation_deg, errors.keyframes);
  return text;
}

nlohmann::ordered_json left_out_json(const Taken& taken) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const DemoProblem& problem : taken.left_out)
    list.push_back({{"id", problem.id}, {"problem", problem.problem}});
  return list;
}

void tell_result(const TrainStatus& now, const Taken& taken, const std::filesystem::path& policy,
                 int processes, bool json) {
  if (json) {
    print_json({{"steps", now.step},
                {"minutes", now.minutes},
                {"loss", now.loss},
                {"loss_position", now.loss_position},
                {"loss_rotation", now.loss_rotation},
                {"loss_open", now.loss_open},
                {"skipped", now.skipped},
                {"validation", validation_json(now.validation)},
                {"left_out", left_out_json(taken)},
                {"samples_per_s", now.samples_per_s},
                {"processes", processes},
                {"policy", policy.string()}});
    return;
  }
  const Validation& v = now.validation;
  const std::string error = v.keyframes > 0 ? "held-out error " + errors_text(v)
                                            : "no held-out error (a task's 10th demonstration is the first "
                                              "that is held out)";
  std::printf("%lld steps in %.1f minutes, loss %.4f, %s: %s\n", static_cast<long long>(now.step),
              now.minutes, now.loss, error.c_str(), policy.c_str());
  for (const TaskError& t : v.tasks)
    if (t.keyframes > 0) std::printf("  %-28s %s\n", t.task.c_str(), errors_text(t).c_str());
}

int train_with(const TrainCall& call, const Context& context,
               const std::shared_ptr<GradientExchange>& exchange) {
  if (call.steps <= 0 && call.minutes <= 0) throw UsageError("--steps or --minutes says how long to train");
  const bool first = exchange->rank() == 0;
  existing_data(context);
  const auto trainer = make_trainer(call, exchange);
  const Taken taken = take_demonstrations(*trainer, call, context);
  const auto lock = first ? std::optional(lock_policy(call.policy, "train")) : std::nullopt;
  if (first) tell_taken(*trainer, taken);
  if (first && exchange->size() > 1) std::fprintf(stderr, "in %d processes\n", exchange->size());

  std::signal(SIGINT, [](int) { interrupted = true; });
  std::signal(SIGTERM, [](int) { interrupted = true; });
  // Steps and minutes are the same on every rank, so all do the same here.
  TrainStatus now = trainer->status();
  if (call.resume) {  // --minutes and --steps count from now on, and the schedule ends with them
    trainer->go_on_for(call.minutes, call.steps);
    if (first) tell_resumed(now);
  }
  const std::int64_t first_step = now.step;
  const double until_minutes = now.minutes + call.minutes;
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
    if (call.minutes > 0 && now.minutes >= until_minutes) break;
  }
  trainer->require_agreement();
  if (!first) return 0;
  if (now.step == first_step) std::fprintf(stderr, "interrupted before the first step: nothing was learnt\n");
  now.validation = trainer->validate();
  trainer->save(call.policy);
  tell_result(now, taken, call.policy, exchange->size(), context.json);
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
  command->add_option("--steps", call->steps, "Optimiser steps to take, with --resume from now on")
      ->check(CLI::PositiveNumber);
  command->add_option("--minutes", call->minutes, "Minutes to train, with --resume from now on")
      ->check(CLI::PositiveNumber);
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
