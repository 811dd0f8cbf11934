// Studio: waypoints picked in the picture, movements by hand.
#include "app/studio.h"
#include "app/waypoint_overlay.h"

namespace flowscope {

using web::ApiError;
using web::TeleopStatus;

SceneState Studio::shown_state() const {
  const auto pinned = render_.pinned();
  return pinned ? *pinned : scene()->state;
}

CameraModel Studio::view_camera(const std::string& id) {
  const auto view = render_.view(id);
  if (!view.camera) return view.orbit.model(view.width, view.height);
  return render_.camera(shown_state(), view).get();
}

web::PickAnswer Studio::pick(const web::PickRequest& request) {
  const CameraModel camera = view_camera(request.view);
  return scratch_.at(shown_state(), [&](const World& world) {
    const auto picked = flowscope::pick(world, camera, request.u * camera.width, request.v * camera.height);
    if (!picked) throw ApiError(404, "nothing_there", "there is nothing at that place of the picture");
    return web::PickAnswer{*picked, propose_waypoints(world, *picked, world.robot().world_from_tool)};
  });
}

std::vector<NamedFrame> Studio::frames() { return scratch_.at(scene()->state, scene_frames); }

std::vector<PlacedStep> Studio::set_waypoints(const web::WaypointsRequest& request) {
  const auto sim = scene();
  std::optional<Script> script;
  if (!request.script.empty()) script = read_script(request.script, sim->task);
  auto steps = waypoints_.set(std::move(script), request.selected, *sim, scratch_);
  render_.show("waypoints", overlay_of_waypoints(steps, request.selected));
  return steps;
}

void Studio::draw_waypoints() {
  try {
    if (waypoints_.follow(*scene(), scratch_))
      render_.show("waypoints", overlay_of_waypoints(waypoints_.steps(), waypoints_.selected()));
  } catch (const std::exception&) {
    // The scene changed under the script: the page that shows it will say so when it asks.
    render_.show("waypoints", {});
  }
}

TeleopStatus Studio::teleop() {
  const auto sim = scene();
  const auto jog = sim_.jog_report();
  TeleopStatus status;
  status.world_from_tool = sim->robot.world_from_tool;
  status.openness = sim->robot.openness;
  status.jog = to_string(jog.state);
  status.message = jog.message;
  status.frames = sim->by_hand.frames;
  status.strokes = sim->by_hand.strokes;
  status.marks = sim->by_hand.marks;
  status.by_hand = sim->by_hand.moved;
  status.success = sim->success;
  return status;
}

void Studio::require_rest() {
  require_robot();
  std::lock_guard lock(mutex_);
  if (jobs_.goes_on(motion_job_))
    throw ApiError(409, "motion_running", "the arm follows a script; stop it first (q)",
                   "job " + motion_job_);
}

void Studio::take_over() {
  require_rest();
  bool shown = false;
  {
    std::lock_guard lock(mutex_);
    shown = shown_.has_value();
  }
  if (shown) clear_shown();
}

TeleopStatus Studio::jog(const web::JogRequest& request) {
  take_over();
  sim_.jog({request.linear_m_s, request.angular_rad_s, request.in_tool_frame, request.may_touch});
  ++change_;
  return teleop();
}

TeleopStatus Studio::jog_gripper(double openness) {
  take_over();
  const MotionResult result = sim_.jog_gripper(openness).get();
  if (!result) throw ApiError(422, to_string(result.failure), result.message);
  return teleop();
}

TeleopStatus Studio::undo_jog() {
  take_over();
  if (!sim_.undo_jog().get()) throw ApiError(409, "nothing_to_undo", "nothing was moved by hand");
  return teleop();
}

std::vector<Step> Studio::mark_keyframe() {
  require_rest();  // the simulator would answer only when the script has ended
  return sim_.mark().get();
}

std::string Studio::save_teleop(bool unfinished) {
  take_over();
  const auto sim = scene();
  if (!sim->by_hand.moved)
    throw ApiError(409, "nothing_by_hand", "nothing was moved by hand since the reset");
  Demo demo;
  try {
    demo = sim_.session_demo([this](const SceneState& state) { return render_.observe(state).get(); }).get();
  } catch (const std::logic_error& error) {
    throw ApiError(409, "no_session", error.what());
  }
  // Asked of the demonstration, not of the scene, which may have moved on.
  if (demo.info.unfinished() && !unfinished) {
    std::string open;
    for (const auto& term : sim->terms) {
      if (!term.met) open += (open.empty() ? "" : ", ") + term.name;
    }
    throw ApiError(409, "not_done", "the task is not done (" + open + "); save it all the same?",
                   "unfinished");
  }
  return save_demo(demo);
}

}  // namespace flowscope
