// A Backend with canned data and a clock: for the server's tests and for working on the page without a
// simulator.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <type_traits>

#include "tests/support/fake_pictures.h"
#include "tests/support/fake_teleop.h"
#include "tests/support/fake_terms.h"
#include "tests/support/fake_values.h"
#include "web/backend.h"
#include "web/server.h"

namespace flowscope::testing {

using namespace flowscope::web;

class FakeBackend : public Backend {
 public:
  FakeBackend() {
    for (int i = 0; i < 2; ++i) {
      const std::string id = "push_buttons-000" + std::to_string(i + 1);
      demos_[id] = fake_demo(id, static_cast<std::uint64_t>(i));
    }
    traces_["t1"] = fake_trace("t1", 4, 7);
    state_.task = "push_buttons";
    state_.seed = 7;
    state_.instruction = "push the red button, then the blue button";
    state_.views = {ViewSettings{}};
    state_.cameras = {"front", "left_shoulder", "right_shoulder", "wrist"};
    state_.policy = {true, "policies/live.fsp", 1240};
    exports_ = std::filesystem::temp_directory_path() / ("flowscope-fake-" + std::to_string(::getpid()));
    std::filesystem::create_directories(exports_);
  }
  ~FakeBackend() override { std::filesystem::remove_all(exports_); }

  std::function<void(Event)> on_event = [](Event) {};
  std::atomic<bool> ready{true};
  std::atomic<int> viewers{0}, viewer_changes{0};

  /// One twentieth of a second: jobs and training go on. Returns the picture of the main view.
  FramePtr tick(std::uint64_t sequence) {
    const std::lock_guard lock(mutex_);
    state_.time_s += 0.05;
    for (auto& [id, job] : jobs_) advance(job);
    if (report_.running) {
      advance_training(report_);
      if (sequence % 20 == 0) on_event(report_);
    }
    if (sequence % 20 == 0) on_event(snapshot_locked());
    auto frame = std::make_shared<EncodedFrame>();
    frame->jpeg = fake_jpeg(picture(state_.views[0], 0, 0));
    frame->sequence = sequence;
    frame->timestamp_s =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    ++metrics_.frames_rendered;
    ++metrics_.frames_encoded;
    return frame;
  }

  Health health() override { return {ready, ready ? "" : "compiling scenes"}; }
  Metrics metrics() override {
    return locked([&] { return metrics_; });
  }
  StateSnapshot state() override {
    return locked([&] { return snapshot_locked(); });
  }
  std::vector<TaskEntry> tasks() override {
    return {{"push_buttons", 50, {"push the red button, then the blue button"}},
            {"open_drawer", 3, {"open the bottom drawer", "open the middle drawer", "open the top drawer"}}};
  }
  StateSnapshot reset(const std::string& task, std::optional<int> variation,
                      std::optional<std::uint64_t> seed) override {
    return locked([&] {
      const auto known = tasks();
      const auto found =
          std::find_if(known.begin(), known.end(), [&](const auto& entry) { return entry.name == task; });
      if (found == known.end()) throw ApiError(404, "unknown_task", "there is no task " + task, "task");
      if (variation.value_or(0) >= found->variations)
        throw ApiError(400, "bad_value", "variation is out of range", "variation");
      state_.task = task;
      state_.variation = variation.value_or(0);
      state_.seed = seed.value_or(state_.seed + 1);
      state_.instruction =
          found->instructions[static_cast<std::size_t>(state_.variation) % found->instructions.size()];
      state_.time_s = 0;
      ++state_.episode;
      on_event(snapshot_locked());
      return snapshot_locked();
    });
  }
  ViewSettings view(const std::string& id) override {
    return locked([&] {
      if (id != "main") throw ApiError(404, "unknown_view", "there is no view " + id, "id");
      return state_.views[0];
    });
  }
  ViewSettings set_view(const ViewSettings& settings) override {
    return locked([&] {
      if (settings.camera && !contains(state_.cameras, *settings.camera))
        throw ApiError(400, "unknown_camera", "there is no camera " + *settings.camera, "camera");
      state_.views[0] = settings;
      on_event(snapshot_locked());
      return settings;
    });
  }
  ViewSettings drag_view(const std::string& id, const CameraDrag& drag) override {
    ViewSettings settings = view(id);
    settings.camera.reset();
    if (drag.action == "rotate") {
      settings.orbit.azimuth_deg -= 180 * drag.dx;
      settings.orbit.elevation_deg -= 180 * drag.dy;
    } else if (drag.action == "zoom") {
      settings.orbit.distance_m *= 1 + 0.5 * drag.dy;
    } else {
      settings.orbit.lookat.z() += drag.dy;
    }
    return set_view(settings);
  }
  std::string task_script(const std::string& task) override {
    return "task: " + task +
           "\nsteps:\n  - move: {frame: world, position: [0.3, 0, 0.9], rpy_deg: [180, 0, 0]}\n" +
           "  - gripper: close\n";
  }
  std::string run_script(const ScriptRequest& request) override {
    if (request.script.find("steps") == std::string::npos && !request.script.empty())
      throw ApiError(400, "bad_script", "script:1:1: steps is missing", "script:1:1");
    return locked([&] { return start("script", request.record ? "push_buttons-0001" : "", "", ""); });
  }
  std::vector<JobStatus> jobs() override {
    return locked([&] {
      std::vector<JobStatus> list;
      for (const auto& [id, job] : jobs_) list.push_back(job);
      return list;
    });
  }
  JobStatus job(const std::string& id) override {
    return locked([&] { return find(jobs_, id, "job"); });
  }
  void cancel_job(const std::string& id) override {
    locked([&] {
      JobStatus& job = find(jobs_, id, "job");
      if (job.state == "running" || job.state == "queued") job.state = "cancelled";
      on_event(job);
    });
  }
  std::vector<DemoInfo> demos() override {
    return locked([&] {
      std::vector<DemoInfo> list;
      for (const auto& [id, demo] : demos_) list.push_back(demo.info);
      return list;
    });
  }
  Demo demo(const std::string& id) override {
    return locked([&] { return find(demos_, id, "demonstration"); });
  }
  std::vector<std::uint8_t> demo_picture(const std::string& id, int keyframe,
                                         const std::string& camera) override {
    const Demo demo = this->demo(id);
    if (keyframe >= demo.info.keyframes)
      throw ApiError(404, "unknown_keyframe", "there is no such keyframe", "keyframe");
    if (!contains(state().cameras, camera))
      throw ApiError(404, "unknown_camera", "there is no such camera", "camera");
    return fake_png(draw_scene(128, 128, keyframe, static_cast<std::uint8_t>(camera.size() * 10)));
  }
  void remove_demo(const std::string& id) override {
    locked([&] {
      find(demos_, id, "demonstration");
      demos_.erase(id);
    });
  }
  TrainReport train(const TrainRequest& request) override {
    return locked([&] {
      if (!request.start && !report_.running) throw ApiError(409, "not_training", "nothing is training");
      report_.running = request.start;
      on_event(report_);
      return report_;
    });
  }
  TrainReport train_report() override {
    return locked([&] { return report_; });
  }
  std::vector<std::string> predict(const PredictRequest& request) override {
    return locked([&] {
      std::vector<std::string> ids;
      for (int i = 0; i < request.samples; ++i) {
        const std::string id = "t" + std::to_string(traces_.size() + 1);
        traces_[id] = fake_trace(id, request.flow_steps, request.seed + static_cast<std::uint64_t>(i));
        traces_[id].objective = request.objective.value_or("cfm");
        traces_[id].radius.kind = request.radius.value_or("linear");
        on_event(entry(traces_[id]));
        ++metrics_.predictions;
        ids.push_back(id);
      }
      return ids;
    });
  }
  std::vector<TraceEntry> traces() override {
    return locked([&] {
      std::vector<TraceEntry> list;
      for (const auto& [id, trace] : traces_) list.push_back(entry(trace));
      return list;
    });
  }
  FlowTrace trace(const std::string& id) override {
    return locked([&] { return find(traces_, id, "trace"); });
  }
  void remove_trace(const std::string& id) override {
    locked([&] {
      find(traces_, id, "trace");
      traces_.erase(id);
    });
  }
  void show_trace(const std::string& id, std::optional<int> step) override {
    locked([&] {
      const FlowTrace& trace = find(traces_, id, "trace");
      if (step && *step > trace.flow_steps)
        throw ApiError(400, "bad_step", "the trace has no such step", "step");
      state_.shown.reset();
      if (step) state_.shown = StateSnapshot::Shown{id, *step};
      on_event(snapshot_locked());
    });
  }
  std::string branch_trace(const std::string& id, const BranchRequest& request) override {
    return locked([&] {
      const FlowTrace parent = find(traces_, id, "trace");
      if (request.step > parent.flow_steps)
        throw ApiError(400, "bad_step", "the trace has no such step", "step");
      const std::string branch = "t" + std::to_string(traces_.size() + 1);
      FlowTrace& trace = traces_[branch] = fake_trace(branch, parent.flow_steps, parent.seed);
      trace.parent = FlowTrace::Parent{id, request.step};
      const auto k = static_cast<std::size_t>(request.step);
      if (request.position) trace.steps[k].pose.position = *request.position;
      if (request.quaternion) trace.steps[k].pose.rotation = *request.quaternion;
      if (request.radius_m) trace.steps[k].region.radius_m = *request.radius_m;
      on_event(entry(trace));
      return branch;
    });
  }
  std::string execute_trace(const std::string& id) override {
    return locked([&] {
      find(traces_, id, "trace");
      return start("execute", "", "", "");
    });
  }
  std::string export_media(const ExportRequest& request) override {
    return locked([&] {
      const std::string name = "figure-" + std::to_string(jobs_.size() + 1) + ".png";
      const auto png = fake_png(draw_scene(request.width, request.height, 1, 0, 0.6));
      std::ofstream(exports_ / name, std::ios::binary)
          .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
      return start("export", "", "/exports/" + name, (exports_ / name).string());
    });
  }
  std::vector<std::uint8_t> snapshot(const SnapshotRequest& request) override {
    ViewSettings settings = view(request.view);
    if (request.width) settings.width = request.width;
    if (request.height) settings.height = request.height;
    const std::lock_guard lock(mutex_);
    const ImageRgb image = picture(settings, settings.width, settings.height);
    return request.format == "png" ? fake_png(image) : fake_jpeg(image);
  }
  std::string export_file(const std::string& name) override {
    const auto path = exports_ / name;
    if (!std::filesystem::exists(path)) throw ApiError(404, "not_found", "there is no export " + name);
    return path.string();
  }
  CameraModel view_camera(const std::string& id) override {
    const ViewSettings settings = view(id);
    return settings.orbit.model(settings.width, settings.height);
  }
  PickAnswer pick(const PickRequest& request) override {
    return teleop_.pick(view_camera(request.view), request);
  }
  std::vector<NamedFrame> frames() override { return teleop_.frames(); }
  std::vector<PlacedStep> set_waypoints(const WaypointsRequest& request) override {
    return teleop_.place(request.script);
  }
  TeleopStatus teleop() override { return teleop_.status(); }
  TeleopStatus jog(const JogRequest& request) override { return teleop_.jog(request); }
  TeleopStatus jog_gripper(double openness) override { return teleop_.gripper(openness); }
  TeleopStatus undo_jog() override { return teleop_.undo(); }
  std::vector<Step> mark_keyframe() override { return teleop_.mark(); }
  std::string save_teleop(bool unfinished) override {
    if (!unfinished && !teleop_.status().success)
      throw ApiError(409, "not_done", "the task is not done", "unfinished");
    return "push_buttons-0001";
  }
  void viewers_changed(const std::string& view, int count) override {
    if (view == "main") viewers = count;
    ++viewer_changes;
  }
  std::filesystem::path exports() const { return exports_; }

 private:
  template <typename Call>
  std::invoke_result_t<Call> locked(Call call) {
    const std::lock_guard lock(mutex_);
    return call();
  }
  template <typename Value>
  static Value& find(std::map<std::string, Value>& values, const std::string& id, const std::string& what) {
    const auto found = values.find(id);
    if (found == values.end()) throw ApiError(404, "not_found", "there is no " + what + " " + id, "id");
    return found->second;
  }
  static bool contains(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  static TraceEntry entry(const FlowTrace& trace) {
    TraceEntry entry{
        trace.id, trace.created, trace.scene.task, trace.instruction, trace.flow_steps, trace.error, {}};
    if (trace.parent) entry.parent = trace.parent->trace;
    return entry;
  }
  StateSnapshot snapshot_locked() {
    StateSnapshot snapshot = state_;
    snapshot.terms = fake_terms(state_.time_s);
    snapshot.viewers = viewers;
    snapshot.training = report_.running;
    snapshot.train = report_.status;
    snapshot.teleop = teleop_.status();
    for (const auto& [id, job] : jobs_)
      if (job.kind == "script" && job.state == "running") snapshot.recording = {true, id};
    return snapshot;
  }
  ImageRgb picture(const ViewSettings& settings, int width, int height) const {
    const double turn = settings.orbit.azimuth_deg * 0.0174533;
    const double radius = state_.shown && settings.overlays ? 1.0 / (1 + state_.shown->step) : 0;
    const auto tint = static_cast<std::uint8_t>(settings.camera ? 10 * settings.camera->size() : 0);
    return draw_scene(width ? width : settings.width, height ? height : settings.height, state_.time_s + turn,
                      tint, radius);
  }
  std::string start(const std::string& kind, const std::string& demo, const std::string& url,
                    const std::string& path) {
    JobStatus job;
    job.id = "j" + std::to_string(jobs_.size() + 1);
    job.kind = kind;
    job.state = "running";
    job.message = "planning";
    job.demo = demo;
    job.url = url;
    job.path = path;
    jobs_[job.id] = job;
    on_event(job);
    return job.id;
  }
  void advance(JobStatus& job) {
    if (job.state != "running") return;
    job.progress = std::min(1.0, job.progress + 0.02);
    job.message = job.progress < 0.5 ? "moving to waypoint 1 of 2" : "moving to waypoint 2 of 2";
    if (job.progress >= 1) {
      job.state = "done";
      job.message = "done";
      job.success = true;
    }
    on_event(job);
  }

  std::mutex mutex_;
  StateSnapshot state_;
  TrainReport report_;
  Metrics metrics_;
  std::map<std::string, JobStatus> jobs_;
  std::map<std::string, Demo> demos_;
  std::map<std::string, FlowTrace> traces_;
  std::filesystem::path exports_;
  FakeTeleop teleop_;
};

}  // namespace flowscope::testing
