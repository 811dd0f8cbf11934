#include "app/studio.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/memory.h"

namespace flowscope {

using web::ApiError;
using web::StateSnapshot;
using web::ViewSettings;

Studio::Studio(const StudioOptions& options)
    : options_(options),
      tasks_(options.assets),
      demos_(options.data),
      traces_(options.data / "traces"),
      experts_(tasks_),
      scratch_(tasks_),
      encode_([this](const std::string& view, web::FramePtr frame) {
        std::lock_guard lock(server_mutex_);
        if (server_) server_->publish(view, std::move(frame));
      }),
      sim_(tasks_),
      render_(tasks_, sim_.snapshot(), encode_),
      policy_(demos_, options.data / "policies" / "live.flow",
              [this](const web::TrainReport&) { ++change_; }),
      jobs_([this](const web::JobStatus& status) {
        untidy_ = true;
        send(status);
      }) {
  std::filesystem::create_directories(options.data / "policies");
  std::filesystem::create_directories(options.data / "exports");
  if (options.scene) open_scene(options.scene);
  tasks_.get(options.task);  // an unknown task or a broken file stops the program before it listens
  sim_.on_publish([this] {
    ++change_;
    render_.wake();
  });
  open_policy();
}

/// A scene of any size, looked at from as far away, in its own measure, as the table is.
void Studio::open_scene(const std::shared_ptr<const Task>& scene) {
  tasks_.add(scene);
  const Box bounds = scene->bounds();
  ViewSettings view = render_.view("main");
  view.orbit.lookat = (bounds.min + bounds.max) / 2;
  view.orbit.distance_m = std::clamp(0.65 * (bounds.max - bounds.min).x(), 0.1, 20.0);
  render_.set_view(view);
}

/// The one asked for, else the one that was trained here before; only the first is worth not starting for.
void Studio::open_policy() {
  const auto& trained_here = policy_.file();
  if (!options_.policy.empty()) {
    policy_.load(options_.policy).get();
  } else if (std::filesystem::exists(trained_here)) {
    try {
      policy_.load(trained_here).get();
    } catch (const BadCheckpoint& error) {
      spdlog::warn("the policy trained before is not used: {}", error.what());
    }
  }
}

Studio::~Studio() {
  announcer_.request_stop();
  attach(nullptr);
  leave();
  jobs_.shut_down();
}

void Studio::leave() {
  jobs_.close();
  policy_.leave();
}

void Studio::attach(web::Server* server) {
  {
    std::lock_guard lock(server_mutex_);
    server_ = server;
  }
  if (!server) return;
  try {
    sim_.reset(options_.task, 0, 0).get();
  } catch (const std::exception& error) {
    spdlog::error("opening {}: {}", options_.task, error.what());
    std::lock_guard lock(mutex_);
    first_failure_ = error.what();
  }
  announcer_ = std::jthread([this](std::stop_token stop) { announce(stop); });
}

void Studio::send(web::Event event) {
  std::lock_guard lock(server_mutex_);
  if (server_) server_->send(std::move(event));
}

void Studio::announce(std::stop_token stop) {
  std::uint64_t told = 0;
  std::string told_failure;
  int beat = 0;
  bool was_training = false;
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    tidy();
    const std::uint64_t now = change_;
    const std::string failure = render_.failure();
    if ((now == told && failure == told_failure) || !sim_.snapshot().get()) continue;
    told = now;
    told_failure = failure;
    draw_waypoints();
    send(state());
    const auto report = policy_.report();
    if (was_training && !report.running) untidy_ = true;
    if (report.running != was_training || (report.running && beat++ % 5 == 0)) send(report);
    was_training = report.running;
  }
}

void Studio::tidy() {
  constexpr std::chrono::seconds apart{5};
  const auto now = std::chrono::steady_clock::now();
  if (now - tidied_ < apart || !untidy_.exchange(false)) return;
  tidied_ = now;
  give_back_memory();
}

web::Health Studio::health() {
  std::lock_guard lock(mutex_);
  return {sim_.snapshot().get() != nullptr, first_failure_};
}

web::Metrics Studio::metrics() {
  web::Metrics metrics;
  metrics.frames_rendered = render_.rendered();
  metrics.frames_encoded = encode_.encoded();
  metrics.predictions = predictions_;
  metrics.train_steps = static_cast<std::uint64_t>(policy_.report().status.step);
  return metrics;
}

SimLoop::SnapshotPtr Studio::scene() const {
  auto snapshot = sim_.snapshot().get();
  if (!snapshot) throw ApiError(503, "loading", "no scene is open yet");
  return snapshot;
}

StateSnapshot Studio::state() {
  const auto sim = scene();
  StateSnapshot s;
  s.task = sim->task;
  s.variation = sim->variation;
  s.seed = sim->seed;
  s.instruction = sim->instruction;
  s.episode = sim->episode;
  s.time_s = sim->state.time_s;
  s.success = sim->success;
  s.terms = sim->terms;
  s.views = render_.views();
  s.cameras = observation_cameras(tasks_.get(sim->task)->model());
  s.viewers = render_.viewers();
  s.rendering_error = render_.failure();
  const auto report = policy_.report();
  s.training = report.running;
  s.train = report.status;
  s.policy = policy_.status();
  s.teleop = teleop();
  std::lock_guard lock(mutex_);
  s.shown = shown_;
  if (jobs_.goes_on(motion_job_)) s.recording = {jobs_.get(motion_job_).kind == "script", motion_job_};
  return s;
}

std::vector<web::TaskEntry> Studio::tasks() {
  std::vector<web::TaskEntry> entries;
  for (const auto& name : tasks_.names()) {
    const auto task = tasks_.get(name);
    web::TaskEntry entry{name, task->variations(), {}};
    for (int v = 0; v < task->variations(); ++v) entry.instructions.push_back(task->instructions(v).front());
    entries.push_back(std::move(entry));
  }
  return entries;
}

void Studio::interrupt_motion() { jobs_.cancel_if_known(motion_job_); }

std::string Studio::start_motion(const std::string& kind, std::function<void(JobBoard::Handle&)> work) {
  std::lock_guard lock(mutex_);
  interrupt_motion();
  return motion_job_ = jobs_.start(JobLane::motion, kind, std::move(work));
}

void Studio::clear_shown() {
  {
    std::lock_guard lock(mutex_);
    shown_.reset();
  }
  render_.show("trace", {}, nullptr);
  ++change_;
}

StateSnapshot Studio::reset(const std::string& task, std::optional<int> variation,
                            std::optional<std::uint64_t> seed) {
  std::shared_ptr<const Task> wanted;
  try {
    wanted = tasks_.get(task);
  } catch (const std::invalid_argument& error) {
    throw ApiError(400, "unknown_task", error.what(), "task");
  }
  const int v = variation.value_or(0);
  if (v < 0 || v >= wanted->variations()) {
    throw ApiError(400, "bad_variation",
                   task + " has variations 0 to " + std::to_string(wanted->variations() - 1) + ", not " +
                       std::to_string(v),
                   "variation");
  }
  std::future<void> done;
  {
    std::lock_guard lock(mutex_);  // whoever starts a motion now does so in the new scene
    interrupt_motion();
    done = sim_.reset(task, v, seed.value_or(0));
  }
  clear_shown();
  show_failure({}, "");
  done.get();
  return state();
}

ViewSettings Studio::view(const std::string& id) { return render_.view(id); }

ViewSettings Studio::set_view(const ViewSettings& settings) {
  const auto known = observation_cameras(tasks_.get(scene()->task)->model());
  if (settings.camera && std::ranges::find(known, *settings.camera) == known.end()) {
    throw ApiError(400, "unknown_camera", "there is no camera " + *settings.camera, "camera");
  }
  const RendererOptions limits;
  if (settings.width < 64 || settings.height < 64 || settings.width > limits.max_width ||
      settings.height > limits.max_height) {
    throw ApiError(400, "bad_size", "a view is 64x64 to 1280x960 pixels", "width");
  }
  if (!(settings.orbit.distance_m > 0.05 && settings.orbit.distance_m < 50)) {
    throw ApiError(400, "bad_camera", "the distance must lie between 0.05 and 50 m", "orbit.distance_m");
  }
  render_.set_view(settings);
  ++change_;
  return settings;
}

ViewSettings Studio::drag_view(const std::string& id, const web::CameraDrag& drag) {
  ViewSettings v = render_.view(id);
  v.camera.reset();
  OrbitCamera& o = v.orbit;
  if (drag.action == "rotate") {
    o.azimuth_deg = std::remainder(o.azimuth_deg - 180 * drag.dx, 360.0);
    o.elevation_deg = std::clamp(o.elevation_deg - 180 * drag.dy, -89.0, 89.0);
  } else if (drag.action == "zoom") {
    o.distance_m = std::clamp(o.distance_m * std::exp(drag.dy), 0.1, 20.0);
  } else if (drag.action == "pan") {
    const double meters = 2 * std::tan(o.fovy_deg * std::numbers::pi / 360) * o.distance_m;
    const CameraModel camera = o.model(v.width, v.height);
    o.lookat -= camera.world_from_camera.rotation * Eigen::Vector3d(drag.dx, drag.dy, 0) * meters;
  } else {
    throw ApiError(400, "bad_action", "action is rotate, pan or zoom", "action");
  }
  return set_view(v);
}

std::vector<web::JobStatus> Studio::jobs() { return jobs_.all(); }
web::JobStatus Studio::job(const std::string& id) { return jobs_.get(id); }
void Studio::cancel_job(const std::string& id) { jobs_.cancel(id); }

void Studio::viewers_changed(const std::string& view, int viewers) {
  render_.set_viewers(view, viewers);
  // Watched motion is paced so that it can be followed; otherwise it runs as fast as the machine allows.
  sim_.pace(render_.viewers() > 0 ? 2.0 : 0.0);
  ++change_;
}

}  // namespace flowscope
