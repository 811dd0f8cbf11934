#include "app/policy_loop.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "policy/one_robot.h"
#include "recorder/demo_file.h"

namespace flowscope {

using web::ApiError;
using web::PolicyStatus;
using web::TrainReport;
using web::TrainRequest;

namespace {
constexpr double save_every_minutes = 1.0, validate_every_minutes = 0.5;
constexpr std::chrono::milliseconds slice{20};

ApiError leaving() { return ApiError(503, "shutting_down", "flowscope is shutting down"); }

/// Keeps a curve short enough to send: every other point goes when it is full.
template <class T>
void append_thinned(std::vector<T>& curve, T point) {
  constexpr std::size_t most = 1000;
  if (curve.size() >= most) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < curve.size(); i += 2) curve[kept++] = curve[i];
    curve.resize(kept);
  }
  curve.push_back(std::move(point));
}
}  // namespace

PolicyLoop::PolicyLoop(const DemoStore& store, std::filesystem::path file,
                       std::function<void(const TrainReport&)> on_report)
    : store_(store), file_(std::move(file)), on_report_(std::move(on_report)) {
  report_.publish(TrainReport{});
  status_.publish(PolicyStatus{});
  thread_ = std::jthread([this] {
    Room room;
    auto idle = [&] { return std::chrono::milliseconds(room.training || !room.asked.empty() ? 0 : 1000); };
    while (queue_.run_next(room, idle())) {
      if (!room.asked.empty())
        predict_on(room);
      else if (room.training)
        train_step(room);
    }
    for (const Asked& asked : room.asked) asked.answer->set_exception(std::make_exception_ptr(leaving()));
    room.asked.clear();
    if (room.training) finish(room, "");
  });
}

PolicyLoop::~PolicyLoop() { leave(); }

void PolicyLoop::leave() {
  leaving_ = true;
  interrupt_step();
  queue_.close();
}

void PolicyLoop::interrupt_step() {
  const std::lock_guard lock(step_mutex_);
  step_stop_.request_stop();
}

std::stop_token PolicyLoop::step_stop() {
  const std::lock_guard lock(step_mutex_);
  return step_stop_.get_token();
}

std::future<void> PolicyLoop::load(std::filesystem::path file) {
  return queue_.post([this, file = std::move(file)](Room& room) {
    room.loaded = load_policy(file);
    room.file = file;
    publish(room);
  });
}

void PolicyLoop::add_demo(Room& room, const std::string& id) {
  try {
    const DemoInfo info = read_demo_info(store_.path(id));
    if (!room.tasks.empty() && std::ranges::find(room.tasks, info.task) == room.tasks.end()) return;
    if (info.unfinished() && !room.unfinished) return;
  } catch (const std::exception&) {
    // the intake says what is wrong with it
  }
  if (const std::string problem = room.intake->add(*room.trainer, id); !problem.empty())
    spdlog::warn("left out of training: {}", problem);
}

/// Those that are damaged are told and end no training; without any other there is none.
void PolicyLoop::take_demos(Room& room, const TrainingChoice& choice) {
  for (const DemoProblem& problem : room.intake->add_all(*room.trainer, choice.demos))
    room.report.left_out.emplace_back(problem.id, problem.problem);
  for (const auto& [id, problem] : room.report.left_out) spdlog::warn("left out of training: {}", problem);
  if (room.trainer->status().demos > 0) return;
  const std::string why = room.report.left_out.empty() ? "" : "; " + room.report.left_out.front().second;
  room.trainer.reset();
  if (!room.loaded && std::filesystem::exists(file_)) {  // what was trained here before is not lost
    room.loaded = load_policy(file_);
    room.file = file_;
  }
  publish(room);
  throw ApiError(409, "no_demonstrations", "none of the demonstrations can be learnt from" + why);
}

TrainingChoice PolicyLoop::choice_for(const TrainRequest& request, std::vector<DemoProblem>& left_out) const {
  TrainingChoice choice;
  try {
    choice = choose_training(store_.list(&left_out), request.tasks, request.unfinished);
  } catch (const std::invalid_argument& error) {
    throw ApiError(409, "several_robots", error.what(), "tasks");
  }
  if (choice.demos.empty())
    throw ApiError(409, "no_demonstrations",
                   choice.unfinished > 0
                       ? "there are only unfinished demonstrations: record some that succeed"
                       : "there is nothing to learn from yet: record demonstrations first");
  return choice;
}

std::future<TrainReport> PolicyLoop::start(TrainRequest request) {
  return queue_.post([this, request = std::move(request)](Room& room) {
    if (room.training) throw ApiError(409, "already_training", "training is running; stop it first");
    std::vector<DemoProblem> unreadable;
    const TrainingChoice choice = choice_for(request, unreadable);
    begin(room, request);
    room.report.left_out.clear();
    for (const DemoProblem& problem : unreadable)
      room.report.left_out.emplace_back(problem.id, problem.problem);
    try {
      require_same_robot(room.trainer->robot(), choice.robot);
    } catch (const std::invalid_argument& error) {
      throw ApiError(409, "other_robot", error.what(), "tasks");
    }
    take_demos(room, choice);
    const TrainStatus now = room.trainer->status();
    if (request.resume) room.trainer->go_on_for(request.minutes.value_or(0), request.steps.value_or(0));
    room.until_step = request.steps ? now.step + *request.steps : 0;
    room.until_minutes = request.minutes ? now.minutes + *request.minutes : 0;
    room.saved_minutes = room.validated_minutes = now.minutes;
    {
      const std::lock_guard lock(step_mutex_);
      if (!leaving_) step_stop_ = std::stop_source();
    }
    room.training = true;
    room.report.running = true;
    room.report.error.clear();
    room.report.status = now;
    publish(room);
    return room.report;
  });
}

/// A trainer without demonstrations takes the place of the one before.
void PolicyLoop::begin(Room& room, const TrainRequest& request) {
  TrainOptions options = request.options;
  options.expected_minutes = request.minutes.value_or(0);
  options.expected_steps = request.steps.value_or(0);
  try {
    if (!request.resume) {
      room.trainer = Trainer::create(options);
      room.report = {};
      room.saved.clear();
    } else if (room.trainer && room.trainer->status().step > 0) {
      save_first(room);
      room.trainer = Trainer::resume(file_);
    } else if (room.loaded) {
      room.trainer = Trainer::resume(room.file);
      room.saved = room.file;
    } else {
      throw ApiError(409, "no_policy", "there is no trained policy to go on with");
    }
  } catch (const std::invalid_argument& error) {
    throw ApiError(400, "bad_option", error.what());
  } catch (const BadCheckpoint& error) {
    throw ApiError(409, "bad_policy", error.what());
  }
  room.tasks = request.tasks;
  room.unfinished = request.unfinished;
  room.intake.emplace(store_);
}

/// What could not be saved at the end of the last training is not lost either.
void PolicyLoop::save_first(Room& room) {
  try {
    save(room);
  } catch (const std::exception& error) {
    throw ApiError(507, "not_saved", error.what());
  }
}

void PolicyLoop::save(Room& room) {
  room.trainer->save(file_);  // where this throws, what was saved before is still there
  room.saved = file_;
}

std::future<TrainReport> PolicyLoop::stop() {
  interrupt_step();  // a step of a large network takes many seconds
  return queue_.post([this](Room& room) {
    if (room.training) finish(room, "");
    return room.report;
  });
}

void PolicyLoop::train_step(Room& room) {
  try {
    const std::stop_token stop = step_stop();
    const std::int64_t before = room.trainer->status().step;
    const TrainStatus now = room.trainer->step(stop);
    if (now.step == before) return;  // given up: the job that ends training comes next
    room.report.status = now;
    append_thinned(room.report.loss_history, {now.step, now.loss});
    if (now.minutes - room.validated_minutes >= validate_every_minutes) {
      room.validated_minutes = now.minutes;
      room.report.status.validation = room.trainer->validate(4, stop);
      const Validation& v = room.report.status.validation;
      if (v.keyframes > 0)
        append_thinned(room.report.validation_history, {now.step, v.position_mm, v.rotation_deg});
    }
    if (now.minutes - room.saved_minutes >= save_every_minutes) {
      room.saved_minutes = now.minutes;
      save(room);
    }
    const bool done = (room.until_step > 0 && now.step >= room.until_step) ||
                      (room.until_minutes > 0 && now.minutes >= room.until_minutes);
    if (done) finish(room, "");
  } catch (const std::exception& error) {
    spdlog::error("training stopped: {}", error.what());
    finish(room, error.what());
  }
  publish(room);
}

void PolicyLoop::finish(Room& room, const std::string& error) {
  room.training = false;
  room.report.running = false;
  room.report.error = error;
  try {
    if (error.empty() && room.trainer->status().step > 0) {
      save(room);
      let_go(room);
    }
  } catch (const std::exception& failure) {
    room.report.error = failure.what();
    spdlog::error("saving the policy: {}", failure.what());
  }
  publish(room);
}

bool PolicyLoop::predicts_with_trainer(const Room& room) {
  return room.trainer && room.trainer->status().step > 0;
}

void PolicyLoop::publish(Room& room) {
  report_.publish(room.report);
  PolicyStatus status;
  const bool trained_here = predicts_with_trainer(room);
  status.loaded = trained_here || room.loaded;
  if (status.loaded) status.file = (trained_here ? room.saved : room.file).string();
  if (status.loaded) status.generation = (trained_here ? *room.trainer : *room.loaded).generation();
  status_.publish(status);
  on_report_(room.report);
}

void PolicyLoop::demo_saved(const std::string& id) {
  queue_.post([this, id](Room& room) {
    if (room.trainer) add_demo(room, id);
  });
}

void PolicyLoop::demo_removed(const std::string& id) {
  queue_.post([id](Room& room) {
    if (room.trainer) room.intake->remove(*room.trainer, id);
  });
}

TrainReport PolicyLoop::report() const { return *report_.get(); }
PolicyStatus PolicyLoop::status() const { return *status_.get(); }

void PolicyLoop::let_go(Room& room) {
  try {
    if (leaving_) return;
    room.loaded = load_policy(file_);
    room.file = file_;
    room.trainer = nullptr;
    room.intake.reset();
  } catch (const std::exception& error) {
    spdlog::warn("the policy just saved cannot be read, so it stays in memory: {}", error.what());
  }
}

std::future<std::vector<FlowTrace>> PolicyLoop::predict(PolicyInput input, PredictOptions options,
                                                        int samples, std::stop_token stop) {
  Asked asked{nullptr, nullptr, std::make_shared<Answer>(), std::move(stop)};
  auto future = asked.answer->get_future();
  queue_.post([this, asked = std::move(asked), input = std::move(input), options = std::move(options),
               samples](Room& room) mutable {
    const auto answer = asked.answer;
    try {
      take_up(room, std::move(asked), input, options, samples);
    } catch (const std::invalid_argument& error) {
      answer->set_exception(std::make_exception_ptr(ApiError(400, "bad_option", error.what())));
    } catch (...) {
      answer->set_exception(std::current_exception());
    }
  });
  return future;
}

void PolicyLoop::take_up(Room& room, Asked asked, const PolicyInput& input, const PredictOptions& options,
                         int samples) {
  if (leaving_) throw leaving();
  const bool trained_here = predicts_with_trainer(room);
  if (!trained_here && !room.loaded)
    throw ApiError(409, "no_policy", "there is no policy yet: train one or start with --policy FILE");
  if (trained_here)
    asked.policy = room.trainer;
  else
    asked.policy = room.loaded;
  asked.prediction = asked.policy->begin(input, options, samples);
  asked.in_training = trained_here;
  room.asked.push_back(std::move(asked));
}

void PolicyLoop::predict_on(Room& room) {
  const auto fewest =
      std::ranges::min_element(room.asked, {}, [](const Asked& asked) { return asked.prediction->left(); });
  const auto one = room.slices++ % 2 == 0 ? fewest : room.asked.begin();
  try {
    if (one->stop.stop_requested()) throw ApiError(409, "cancelled", "the prediction was cancelled");
    if (one->prediction->advance(slice)) return;
    std::vector<FlowTrace> traces = one->prediction->take();
    if (one->in_training)
      for (FlowTrace& trace : traces) trace.policy_file = room.saved.string();
    one->answer->set_value(std::move(traces));
  } catch (...) {
    one->answer->set_exception(std::current_exception());
  }
  room.asked.erase(one);
}

}  // namespace flowscope
