// The program behind the page: ties the loops together and answers the server.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/job_board.h"
#include "app/long_predictions.h"
#include "app/policy_loop.h"
#include "app/render_loop.h"
#include "app/scene_input.h"
#include "app/scratch_world.h"
#include "app/sim_loop.h"
#include "app/trace_store.h"
#include "app/waypoint_board.h"
#include "recorder/demo_store.h"
#include "recorder/task.h"
#include "web/backend.h"
#include "web/server.h"

namespace flowscope {

struct StudioOptions {
  std::filesystem::path assets, data;
  std::string task = "push_buttons";
  std::filesystem::path policy;       ///< may be empty
  std::shared_ptr<const Task> scene;  ///< a user's own, opened besides the tasks; may be null
};

/// Every method of the Backend may be called from several threads at once.
class Studio : public web::Backend {
 public:
  explicit Studio(const StudioOptions& options);
  ~Studio() override;

  /// The program is to end: jobs are asked to stop, predictions and training end, and calls that would begin
  /// something get ApiError 503. Waits for nobody; the server answers what is still under way.
  void leave();
  /// From now on pictures and events go to `server`; null: to nobody. The first scene opens then.
  void attach(web::Server* server);

  web::Health health() override;
  web::Metrics metrics() override;
  web::StateSnapshot state() override;
  std::vector<web::TaskEntry> tasks() override;
  web::StateSnapshot reset(const std::string& task, std::optional<int> variation,
                           std::optional<std::uint64_t> seed) override;
  web::ViewSettings view(const std::string& id) override;
  web::ViewSettings set_view(const web::ViewSettings& settings) override;
  web::ViewSettings drag_view(const std::string& id, const web::CameraDrag& drag) override;
  std::string task_script(const std::string& task) override;
  std::string run_script(const web::ScriptRequest& request) override;
  std::vector<web::JobStatus> jobs() override;
  web::JobStatus job(const std::string& id) override;
  void cancel_job(const std::string& id) override;
  std::vector<DemoInfo> demos() override;
  Demo demo(const std::string& id) override;
  std::vector<std::uint8_t> demo_picture(const std::string& id, int keyframe,
                                         const std::string& camera) override;
  void remove_demo(const std::string& id) override;
  web::TrainReport train(const web::TrainRequest& request) override;
  web::TrainReport train_report() override;
  std::vector<std::string> predict(const web::PredictRequest& request) override;
  std::vector<web::TraceEntry> traces() override;
  FlowTrace trace(const std::string& id) override;
  void remove_trace(const std::string& id) override;
  void show_trace(const std::string& id, std::optional<int> step) override;
  std::string branch_trace(const std::string& id, const web::BranchRequest& request) override;
  std::string execute_trace(const std::string& id) override;
  std::string export_media(const web::ExportRequest& request) override;
  std::vector<std::uint8_t> snapshot(const web::SnapshotRequest& request) override;
  std::string export_file(const std::string& name) override;
  CameraModel view_camera(const std::string& id) override;
  web::PickAnswer pick(const web::PickRequest& request) override;
  std::vector<NamedFrame> frames() override;
  std::vector<PlacedStep> set_waypoints(const web::WaypointsRequest& request) override;
  web::TeleopStatus teleop() override;
  web::TeleopStatus jog(const web::JogRequest& request) override;
  web::TeleopStatus jog_gripper(double openness) override;
  web::TeleopStatus undo_jog() override;
  std::vector<Step> mark_keyframe() override;
  std::string save_teleop(bool unfinished) override;
  void viewers_changed(const std::string& view, int viewers) override;

 private:
  SimLoop::SnapshotPtr scene() const;  ///< throws ApiError 503 before the first scene is open
  void announce(std::stop_token stop);
  /// Some seconds after work that took memory.
  void tidy();
  void send(web::Event event);
  void open_policy();
  void open_scene(const std::shared_ptr<const Task>& scene);
  void clear_shown();
  /// Draws where a failed move was to go and why it is not there, until the next run or reset; without a pose
  /// nothing.
  void show_failure(const std::optional<Pose>& world_from_tool, const std::string& reason);
  /// Asks the script or move that runs, if any, to end. Under the mutex.
  void interrupt_motion();
  /// In the place of the one that runs, if any, with nothing between.
  std::string start_motion(const std::string& kind, std::function<void(JobBoard::Handle&)> work);
  /// One script on the sim thread; draws where it failed. Throws ApiError 409 when the scene is another by
  /// then.
  RunReport follow_script(const SimLoop::Placement& placement, const Script& script, bool record,
                          const std::stop_token& stop);
  /// Throws ApiError: 422 for one that the store's check would call bad, 409 when it is there already.
  std::string save_demo(const Demo& demo);
  /// Refuses a movement by hand while a script or a prediction moves the arm; leaves a shown trace.
  void take_over();
  void require_rest();         ///< throws ApiError 409 while a script or a prediction moves the arm
  void require_robot() const;  ///< throws ApiError 409 in a scene without one
  void draw_waypoints();
  /// Throws ApiError for text that is no script, and for one of another task.
  Script read_script(const std::string& text, const std::string& open_task) const;
  /// The state that a view shows now.
  SceneState shown_state() const;
  std::string keep(StoredTrace stored, std::stop_token stop = {});
  std::vector<std::string> predict_until(const web::PredictRequest& request, std::stop_token stop);

  const StudioOptions options_;
  TaskLibrary tasks_;
  DemoStore demos_;
  TraceStore traces_;
  ExpertBook experts_;
  ScratchWorld scratch_;
  WaypointBoard waypoints_;

  std::mutex server_mutex_;
  web::Server* server_ = nullptr;
  mutable std::mutex mutex_;
  std::optional<web::StateSnapshot::Shown> shown_;
  std::string motion_job_, first_failure_;
  std::atomic<std::uint64_t> predictions_{0}, change_{1};
  std::atomic<bool> untidy_{false};  ///< memory was freed that the operating system may have back
  std::chrono::steady_clock::time_point tidied_{};
  std::atomic<int> next_export_{1};
  LongPredictions long_predictions_;

  // In this order: what comes later uses what comes earlier and ends before it.
  EncodeLoop encode_;
  SimLoop sim_;
  RenderLoop render_;
  PolicyLoop policy_;
  JobBoard jobs_;
  std::jthread announcer_;
};

}  // namespace flowscope
