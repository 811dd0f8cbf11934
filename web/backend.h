// What the server asks of the program behind it, in typed values: no JSON, no HTTP. app's Studio implements
// it.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "policy/flow_trace.h"
#include "policy/trainer.h"
#include "recorder/demo.h"
#include "recorder/task.h"
#include "render/camera_model.h"
#include "web/teleop_values.h"

namespace flowscope::web {

/// An answer that is not success. `status` is the HTTP status; `where` names the place in the input, may be
/// empty.
class ApiError : public std::runtime_error {
 public:
  ApiError(int http_status, std::string error_code, const std::string& message, std::string place = {})
      : std::runtime_error(message),
        status(http_status),
        code(std::move(error_code)),
        where(std::move(place)) {}
  int status;
  std::string code, where;
};

struct TaskEntry {
  std::string name;
  int variations = 0;
  std::vector<std::string> instructions;  ///< the first phrasing of each variation
};

struct ViewSettings {
  std::string id = "main";
  std::optional<std::string> camera;  ///< a camera of the scene; empty: the orbit
  OrbitCamera orbit;
  int width = 640, height = 480;
  bool overlays = true;
  bool detectors = false;  ///< the volumes that success terms watch
};

struct RecordingStatus {
  bool running = false;
  std::string job;
};

struct PolicyStatus {
  bool loaded = false;
  std::string file;
  std::uint64_t generation = 0;
};

struct StateSnapshot {
  std::string task;
  int variation = 0;
  std::uint64_t seed = 0;
  std::string instruction;
  std::vector<ViewSettings> views;
  std::vector<std::string> cameras;
  std::uint64_t episode = 0;  ///< counts resets
  double time_s = 0;
  bool success = false;
  std::vector<SuccessTerm> terms;
  RecordingStatus recording;
  bool training = false;
  TrainStatus train;
  PolicyStatus policy;
  int viewers = 0;
  std::string rendering_error;  ///< why there are no pictures; empty while there are
  struct Shown {
    std::string trace;
    int step = 0;
  };
  std::optional<Shown> shown;  ///< the trace step drawn over the views
  TeleopStatus teleop;
};

struct JobStatus {
  std::string id, kind;  ///< kind: script, execute, export
  std::string state;     ///< queued, running, done, failed, cancelled
  double progress = 0;   ///< 0 … 1
  std::string message;   ///< what it does now
  /// Result by kind; empty strings where it does not apply.
  std::string demo, url, path;
  bool success = false;                  ///< script: saved/succeeded; execute: task success
  std::string error_code, error, where;  ///< when failed
};

struct ScriptRequest {
  std::string script;  ///< text; empty: the task's own
  std::string task;    ///< with empty script: whose demonstration; empty: the current one
  bool record = false;
};

struct TrainRequest {
  bool start = false;
  bool resume = false;  ///< go on with the weights that there are; the options that shaped them stay theirs
  TrainOptions options;
  std::optional<std::int64_t> steps;  ///< from now on
  std::optional<double> minutes;      ///< from now on
  std::vector<std::string> tasks;     ///< empty: all that have demonstrations
  bool unfinished = false;            ///< learn from demonstrations that do not succeed, too
};

struct TrainReport {
  bool running = false;
  TrainStatus status;
  std::vector<std::pair<std::int64_t, double>> loss_history;  ///< step, loss; thinned to at most 1000
  std::vector<std::tuple<std::int64_t, double, double>> validation_history;  ///< step, mm, degrees
  std::string error;                                                         ///< why it stopped, if it failed
  std::vector<std::pair<std::string, std::string>> left_out;  ///< damaged demonstrations: id, what is wrong
};

struct PredictRequest {
  int flow_steps = 4;
  std::uint64_t seed = 0;
  int samples = 1;
  std::string integrator = "euler";              ///< PredictOptions::integrator
  std::optional<std::string> objective, radius;  ///< objective: refuse a policy trained with another
};

struct BranchRequest {
  int step = 0;
  std::optional<Eigen::Vector3d> position;
  std::optional<Eigen::Quaterniond> quaternion;
  std::optional<double> radius_m;
  std::optional<int> flow_steps;
};

struct TraceEntry {
  std::string id, created, task, instruction;
  int flow_steps = 0;
  std::optional<PoseError> error;
  std::optional<std::string> parent;
};

struct ExportRequest {
  std::string kind;  ///< png, mp4
  std::string trace, demo;
  std::optional<int> step;
  std::string camera;  ///< empty: the main view
  int width = 1280, height = 960;
  bool detectors = false;  ///< png, mp4: the volumes that success terms watch
};

struct SnapshotRequest {
  std::string view = "main", format = "jpeg";
  int width = 0, height = 0;  ///< 0: the view's own
};

struct Health {
  bool ready = false;
  std::string message;
};

struct Metrics {
  std::uint64_t frames_rendered = 0, frames_encoded = 0, predictions = 0, train_steps = 0;
};

/// What a mouse drag in the live picture does, with MuJoCo's bindings; the deltas are fractions of the view's
/// height.
struct CameraDrag {
  std::string action;  ///< rotate, pan, zoom
  double dx = 0, dy = 0;
};

/// Called from the server's worker threads, several at a time; every method may block for as long as it must,
/// except health(), which answers at once. Throws ApiError.
class Backend {
 public:
  virtual ~Backend() = default;
  virtual Health health() = 0;
  virtual Metrics metrics() = 0;
  virtual StateSnapshot state() = 0;
  virtual std::vector<TaskEntry> tasks() = 0;
  virtual StateSnapshot reset(const std::string& task, std::optional<int> variation,
                              std::optional<std::uint64_t> seed) = 0;
  virtual ViewSettings view(const std::string& id) = 0;
  virtual ViewSettings set_view(const ViewSettings& settings) = 0;
  virtual ViewSettings drag_view(const std::string& id, const CameraDrag& drag) = 0;
  virtual std::string task_script(
      const std::string& task) = 0;  ///< YAML text of the task's own demonstration
  virtual std::string run_script(const ScriptRequest& request) = 0;  ///< job id
  virtual std::vector<JobStatus> jobs() = 0;
  virtual JobStatus job(const std::string& id) = 0;
  virtual void cancel_job(const std::string& id) = 0;
  virtual std::vector<DemoInfo> demos() = 0;
  virtual Demo demo(const std::string& id) = 0;
  virtual std::vector<std::uint8_t> demo_picture(const std::string& id, int keyframe,
                                                 const std::string& camera) = 0;  ///< PNG; keyframe -1: start
  virtual void remove_demo(const std::string& id) = 0;
  virtual TrainReport train(const TrainRequest& request) = 0;
  virtual TrainReport train_report() = 0;
  virtual std::vector<std::string> predict(const PredictRequest& request) = 0;  ///< trace ids
  virtual std::vector<TraceEntry> traces() = 0;
  virtual FlowTrace trace(const std::string& id) = 0;
  virtual void remove_trace(const std::string& id) = 0;
  virtual void show_trace(const std::string& id, std::optional<int> step) = 0;
  virtual std::string branch_trace(const std::string& id, const BranchRequest& request) = 0;
  virtual std::string execute_trace(const std::string& id) = 0;                    ///< job id
  virtual std::string export_media(const ExportRequest& request) = 0;              ///< job id
  virtual std::vector<std::uint8_t> snapshot(const SnapshotRequest& request) = 0;  ///< encoded picture
  virtual std::string export_file(
      const std::string& name) = 0;  ///< path of a finished export; throws ApiError 404
  /// The camera that a view is drawn with now, for its picture size.
  virtual CameraModel view_camera(const std::string& id) = 0;
  virtual PickAnswer pick(const PickRequest& request) = 0;  ///< 404 when nothing is there
  virtual std::vector<NamedFrame> frames() = 0;             ///< that a script may name
  /// Draws a script's waypoints over every view until another call; tells where they lie.
  virtual std::vector<PlacedStep> set_waypoints(const WaypointsRequest& request) = 0;
  virtual TeleopStatus teleop() = 0;
  virtual TeleopStatus jog(const JogRequest& request) = 0;  ///< answers at once
  virtual TeleopStatus jog_gripper(double openness) = 0;    ///< closing grasps, opening releases
  virtual TeleopStatus undo_jog() = 0;                      ///< 409 when there is nothing to undo
  virtual std::vector<Step> mark_keyframe() = 0;            ///< the present pose as steps of a script
  virtual std::string save_teleop(bool unfinished) = 0;     ///< demonstration id; 409 unless it succeeded
  /// The number of stream viewers of a view changed: nothing is rendered for a view that nobody watches.
  virtual void viewers_changed(const std::string& view, int viewers) = 0;
};

}  // namespace flowscope::web
