// Studio: scripts that are run and recorded.
#include <algorithm>

#include "app/failure_overlay.h"
#include "app/studio.h"
#include "recorder/script_check.h"

namespace flowscope {

using web::ApiError;
using web::JobStatus;

std::string Studio::task_script(const std::string& task) {
  const auto names = tasks_.names();
  if (std::ranges::find(names, task) == names.end())
    throw ApiError(404, "not_found", "there is no task " + task);
  const auto sim = scene();
  if (sim->task == task) return sim->script_text;
  World world(tasks_.get(task));
  world.reset(0, 0);
  return world.episode().demonstration_text;
}

void Studio::require_robot() const {
  if (tasks_.get(scene()->task)->robot().joints.empty()) {
    throw ApiError(409, "no_robot",
                   "this scene is open for viewing only: serve it with --robot to move in it");
  }
}

namespace {

/// "script:3:5: what is wrong" as an answer; its place is script:3:5.
ApiError bad_script(const BadScript& error) {
  const std::string what = error.what();
  return {400, "bad_script", what, what.substr(0, what.find(": "))};
}

std::string place_in_script(const TextPlace& place) {
  return "script:" + std::to_string(place.line) + ":" + std::to_string(place.column);
}

}  // namespace

Script Studio::read_script(const std::string& text, const std::string& open_task) const {
  Script script;
  try {
    script = parse_script(text, "script");
  } catch (const BadScript& error) {
    throw bad_script(error);
  }
  if (script.task.empty() || script.task == open_task) return script;
  const std::string where = place_in_script(script.task_place);
  const auto names = tasks_.names();
  if (std::ranges::find(names, script.task) == names.end())
    throw ApiError(400, "bad_script", where + ": there is no task " + script.task, where);
  throw ApiError(409, "other_task", "the script is for " + script.task + "; the open task is " + open_task,
                 where);
}

std::string Studio::run_script(const web::ScriptRequest& request) {
  const auto sim = scene();
  require_robot();
  if (request.script.empty() && !request.task.empty() && request.task != sim->task) {
    throw ApiError(409, "other_task",
                   "the open task is " + sim->task + "; reset to " + request.task + " first", "task");
  }
  const Script script = read_script(request.script.empty() ? sim->script_text : request.script, sim->task);
  try {
    check_script(script, *tasks_.get(sim->task));
  } catch (const BadScript& error) {
    throw bad_script(error);
  }
  clear_shown();
  show_failure({}, "");
  const SimLoop::Placement placement{sim->task, sim->variation, sim->seed};
  return start_motion("script", [=, this, record = request.record](JobBoard::Handle& handle) {
    handle.update([&](JobStatus& s) { s.message = record ? "recording" : "running"; });
    const RunReport report = follow_script(placement, script, record, handle.stop());
    if (!report.success && record) {
      throw ApiError(422, "run_failed", report.reason,
                     report.line > 0 ? "script:" + std::to_string(report.line) : "");
    }
    if (record && handle.stop().stop_requested()) return;  // who cancels wants no demonstration
    const std::string id = report.demo ? save_demo(*report.demo) : "";
    handle.update([&](JobStatus& s) {
      s.demo = id;
      s.success = report.success;
      if (!report.success)
        s.message = report.reason;
      else
        s.message = id.empty() ? "the task succeeded" : "saved " + id;
      if (id.empty()) return;
      s.state = "done";  // a cancellation that comes now comes too late
      s.progress = 1;
    });
  });
}

RunReport Studio::follow_script(const SimLoop::Placement& placement, const Script& script, bool record,
                                const std::stop_token& stop) {
  const auto observe = [this](const SceneState& state) { return render_.observe(state).get(); };
  RunReport report;
  try {
    report = record ? sim_.record_script(placement, script, observe, stop).get()
                    : sim_.run_script(placement, script, stop).get();
  } catch (const SimLoop::SceneChanged& error) {
    throw ApiError(409, "other_scene", error.what());
  }
  if (!report.success && !stop.stop_requested()) show_failure(report.world_from_tool, report.reason);
  return report;
}

std::string Studio::save_demo(const Demo& demo) {
  std::string id;
  try {
    id = demos_.save(demo);
  } catch (const RefusedDemo& error) {
    const std::string what = std::string("not saved: ") + error.what();
    if (error.twin.empty()) throw ApiError(422, "bad_demonstration", what);
    throw ApiError(409, "known_already", what + "; another placement gives another one");
  }
  policy_.demo_saved(id);
  return id;
}

void Studio::show_failure(const std::optional<Pose>& world_from_tool, const std::string& reason) {
  render_.show("failure", world_from_tool ? overlay_of_failure(*world_from_tool, reason) : Overlay{});
}

}  // namespace flowscope
