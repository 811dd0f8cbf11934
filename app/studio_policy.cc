// Studio: training, prediction, traces.
#include "app/studio.h"
#include "app/trace_overlay.h"

namespace flowscope {

using web::ApiError;

web::TrainReport Studio::train(const web::TrainRequest& request) {
  return request.start ? policy_.start(request).get() : policy_.stop().get();
}

web::TrainReport Studio::train_report() { return policy_.report(); }

std::string Studio::keep(StoredTrace stored, std::stop_token stop) {
  ++predictions_;
  untidy_ = true;
  if (const auto expert =
          experts_.keyframe(stored.trace.scene.task, stored.trace.scene.variation, stored.trace.scene.seed,
                            stored.input->keyframe_index, std::move(stop))) {
    compare_with_expert(stored.trace, *expert);
  }
  const std::string id = traces_.add(std::move(stored));
  send(entry_of(traces_.get(id)->trace));
  return id;
}

std::vector<std::string> Studio::predict(const web::PredictRequest& request) {
  const LongPredictions::Place place(long_predictions_, request.flow_steps * request.samples);
  return predict_until(request, {});
}

std::vector<std::string> Studio::predict_until(const web::PredictRequest& request, std::stop_token stop) {
  const auto sim = scene();
  const auto input = std::make_shared<PolicyInput>();
  input->instruction = sim->instruction;
  input->robot = tasks_.get(sim->task)->robot().name;
  input->history = sim->keyframe_history;
  input->keyframe_index = static_cast<int>(sim->keyframe_history.size()) - 1;
  input->observation = render_.observe(sim->state).get();
  PredictOptions options;
  options.flow_steps = request.flow_steps;
  options.seed = request.seed;
  options.radius_kind = request.radius;
  options.integrator = request.integrator;
  std::vector<FlowTrace> traces = policy_.predict(*input, options, request.samples, stop).get();
  if (request.objective && *request.objective != traces.front().objective) {
    throw ApiError(400, "bad_option",
                   "this policy was trained with the objective " + traces.front().objective, "objective");
  }
  std::vector<std::string> ids;
  for (FlowTrace& trace : traces) {
    StoredTrace one{std::move(trace), sim->state, input, sim->episode};
    one.trace.scene.task = sim->task;
    one.trace.scene.variation = sim->variation;
    one.trace.scene.seed = sim->seed;
    one.trace.scene.keyframe = input->keyframe_index;
    one.trace.scene.state_sha256 = state_sha256(sim->state);
    ids.push_back(keep(std::move(one), stop));
  }
  return ids;
}

std::vector<web::TraceEntry> Studio::traces() { return traces_.list(); }
FlowTrace Studio::trace(const std::string& id) { return traces_.get(id)->trace; }

void Studio::remove_trace(const std::string& id) {
  traces_.remove(id);
  bool was_shown = false;
  {
    std::lock_guard lock(mutex_);
    was_shown = shown_ && shown_->trace == id;
  }
  if (was_shown) clear_shown();
}

void Studio::show_trace(const std::string& id, std::optional<int> step) {
  if (!step) {
    clear_shown();
    return;
  }
  const auto stored = traces_.get(id);
  if (*step < 0 || *step > stored->trace.flow_steps) {
    throw ApiError(400, "bad_step", "steps run from 0 to " + std::to_string(stored->trace.flow_steps),
                   "step");
  }
  {
    std::lock_guard lock(mutex_);
    shown_ = {id, *step};
  }
  render_.show("trace", overlay_of(stored->trace, *step), std::make_shared<const SceneState>(stored->state));
  ++change_;
}

std::string Studio::branch_trace(const std::string& id, const web::BranchRequest& request) {
  const auto parent = traces_.get(id);
  if (request.step < 0 || request.step >= parent->trace.flow_steps) {
    throw ApiError(400, "bad_step",
                   "a branch starts at step 0 to " + std::to_string(parent->trace.flow_steps - 1), "step");
  }
  PredictOptions options;
  options.flow_steps = request.flow_steps.value_or(parent->trace.flow_steps);
  options.seed = parent->trace.seed;
  options.radius_kind = parent->trace.radius.kind;
  options.integrator = parent->trace.integrator;
  options.branch = PredictOptions::Branch{&parent->trace, request.step, request.position, request.quaternion,
                                          request.radius_m};
  const LongPredictions::Place place(long_predictions_, options.flow_steps);
  StoredTrace child{std::move(policy_.predict(*parent->input, options).get().front()), parent->state,
                    parent->input, parent->episode};
  child.trace.scene = parent->trace.scene;
  child.trace.parent = FlowTrace::Parent{id, request.step};
  return keep(std::move(child));
}

}  // namespace flowscope
