// A trace file is foreign input: whatever no prediction can be is refused, and the refusal names its place.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/fake_values.h"
#include "web/wire.h"

namespace flowscope::web::wire {
namespace {

struct Damage {
  const char* pointer;  ///< JSON pointer to what is replaced
  const char* value;    ///< JSON; empty: taken out
  const char* where;    ///< what the refusal names
};

Json good() {
  FlowTrace trace = testing::fake_trace("t1", 4, 7);
  trace.parent = FlowTrace::Parent{"trace-00001", 2};
  trace.scene.demo = "push_buttons-0001";
  trace.scene.keyframe = 1;
  return to_json(trace, /*with_weights=*/true);
}

class DamagedTrace : public ::testing::TestWithParam<Damage> {};

TEST_P(DamagedTrace, IsRefusedByItsPlace) {
  Json json = good();
  ASSERT_NO_THROW(trace_from_json(json));
  const Json::json_pointer pointer(GetParam().pointer);
  if (*GetParam().value == '\0') {
    Json& parent = json.at(pointer.parent_pointer());
    if (parent.is_array()) {
      parent.erase(parent.size() - 1);
    } else {
      parent.erase(pointer.back());
    }
  } else {
    json[pointer] = Json::parse(GetParam().value);
  }
  for (const std::string place : {"", "[2]"}) {
    try {
      trace_from_json(json, place);
      ADD_FAILURE() << GetParam().pointer << " = " << GetParam().value << " was taken";
    } catch (const ApiError& error) {
      EXPECT_EQ(error.where, (place.empty() ? "" : place + ".") + GetParam().where) << error.what();
      EXPECT_EQ(error.status, 400);
    }
  }
}

const Damage damages[] = {
    {"/format", R"("flowscope-trace/2")", "format"},
    {"/id", R"("../t1")", "id"},
    {"/id", R"("")", "id"},
    {"/id", R"("t\u0000")", "id"},
    {"/created", R"("yesterday")", "created"},
    {"/policy/backbone", R"("lstm")", "policy.backbone"},
    {"/policy/objective", R"("gan")", "policy.objective"},
    {"/policy/weights_sha256", R"("abc")", "policy.weights_sha256"},
    {"/policy/file", R"("a\nb")", "policy.file"},
    {"/policy/generation", "-1", "policy.generation"},
    {"/radius/kind", R"("round")", "radius.kind"},
    {"/radius/r_0", "0", "radius.r_0"},
    {"/radius/r_0", "1e9", "radius.r_0"},
    {"/radius/r_min", "1", "radius.r_min"},
    {"/integrator", R"("heun")", "integrator"},
    {"/flow_steps", "0", "flow_steps"},
    {"/flow_steps", "5", "steps"},
    {"/flow_steps", "2147483648", "flow_steps"},
    {"/scene/task", R"("../../etc")", "scene.task"},
    {"/scene/task", R"("..")", "scene.task"},
    {"/scene/task", R"("/etc/passwd")", "scene.task"},
    {"/scene/task", R"("a b")", "scene.task"},
    {"/scene/task", "7", "scene.task"},
    {"/scene/demo", R"("../x")", "scene.demo"},
    {"/scene/variation", "-1", "scene.variation"},
    {"/scene/variation", "1e12", "scene.variation"},
    {"/scene/keyframe", "0.5", "scene.keyframe"},
    {"/scene/state_sha256", R"("zz")", "scene.state_sha256"},
    {"/steps", "[]", "steps"},
    {"/steps", "{}", "steps"},
    {"/steps", "null", "steps"},
    {"/steps/4", "", "steps"},
    {"/steps/1", "[]", "steps[1]"},
    {"/steps/1/k", "2", "steps[1].k"},
    {"/steps/0/t", "0.1", "steps[0].t"},
    {"/steps/2/t", "0.25", "steps[2].t"},
    {"/steps/2/t", "-1", "steps[2].t"},
    {"/steps/4/t", "0.9", "steps[4].t"},
    {"/steps/2/x", "[1,2]", "steps[2].x"},
    {"/steps/2/x/3", "null", "steps[2].x"},
    {"/steps/2/velocity", R"(["a",0,0,0,0,0,0,0,0])", "steps[2].velocity"},
    {"/steps/3/pose/quaternion", "[1,1,0,0]", "steps[3].pose.quaternion"},
    {"/steps/3/pose/quaternion", "[0,0,0,0]", "steps[3].pose.quaternion"},
    {"/steps/3/pose/position/1", "1e300", "steps[3].pose.position"},
    {"/steps/3/pose", "", "steps[3].pose"},
    {"/steps/3/region/center", "[0,0]", "steps[3].region.center"},
    {"/steps/3/region/radius", "-0.1", "steps[3].region.radius"},
    {"/steps/3/region/points", "-1", "steps[3].region.points"},
    {"/steps/3/open_probability", "2", "steps[3].open_probability"},
    {"/steps/3/ms", "-1", "steps[3].ms"},
    {"/steps/0/weights", R"("heavy")", "steps[0].weights"},
    {"/steps/0/weights/1/weight", "2", "steps[0].weights[1].weight"},
    {"/steps/0/weights/1/position", "[0]", "steps[0].weights[1].position"},
    {"/result", "null", "result"},
    {"/result/openness", "0.9", "result.open"},
    {"/result/openness", "7", "result.openness"},
    {"/expert/quaternion", "[2,0,0,0]", "expert.quaternion"},
    {"/expert", "null", "error"},
    {"/error/position_m", "-1", "error.position_m"},
    {"/error/rotation_deg", "360", "error.rotation_deg"},
    {"/parent/trace", R"("../../x")", "parent.trace"},
    {"/parent/step", "-1", "parent.step"},
};

INSTANTIATE_TEST_SUITE_P(Every, DamagedTrace, ::testing::ValuesIn(damages));

}  // namespace
}  // namespace flowscope::web::wire
