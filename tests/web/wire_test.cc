#include "web/wire.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "tests/support/fake_values.h"
#include "web/requests.h"

namespace flowscope::web::wire {
namespace {

/// The refusal that `call` throws, or a failure of the test.
template <typename Call>
ApiError refusal(Call call) {
  try {
    call();
  } catch (const ApiError& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was refused";
  return ApiError(0, "", "");
}

TEST(TraceJson, KeepsEveryBitOfEveryNumber) {
  FlowTrace trace = testing::fake_trace("t9", 6, 11);
  trace.seed = std::numeric_limits<std::uint64_t>::max();
  trace.steps[2].x[3] = 0.1 + 0.2;
  trace.steps[2].velocity[0] = 5e-324;
  trace.parent = FlowTrace::Parent{"t1", 3};
  trace.scene.demo = "push_buttons-0001";
  trace.scene.keyframe = 2;
  const std::string text = dump(to_json(trace));
  const FlowTrace back = trace_from_json(Json::parse(text));
  ASSERT_EQ(back.steps.size(), trace.steps.size());
  for (std::size_t k = 0; k < trace.steps.size(); ++k) {
    EXPECT_EQ(back.steps[k].x, trace.steps[k].x);
    EXPECT_EQ(back.steps[k].velocity, trace.steps[k].velocity);
    EXPECT_TRUE(back.steps[k].pose == trace.steps[k].pose);
    EXPECT_EQ(back.steps[k].region.radius_m, trace.steps[k].region.radius_m);
  }
  EXPECT_EQ(back.seed, trace.seed);
  EXPECT_EQ(back.scene.keyframe, 2);
  EXPECT_EQ(back.parent->trace, "t1");
  EXPECT_EQ(dump(to_json(back)), text);
}

TEST(TraceJson, HasTheShapeOfTheContract) {
  const Json json = to_json(testing::fake_trace("t1", 4, 7));
  EXPECT_EQ(json["format"], "flowscope-trace/1");
  EXPECT_EQ(json["steps"].size(), 5u);
  EXPECT_EQ(json["steps"][0]["t"], 0.0);
  EXPECT_EQ(json["steps"][4]["t"], 1.0);
  EXPECT_EQ(json["steps"][1]["x"].size(), 9u);
  EXPECT_EQ(json["radius"]["kind"], "linear");
  EXPECT_EQ(json["policy"]["backbone"], "mamba");
  EXPECT_TRUE(json["result"]["open"].is_boolean());
  EXPECT_TRUE(json["parent"].is_null());
  EXPECT_FALSE(json["scene"].contains("demo"));
  EXPECT_FALSE(json["steps"][0].contains("weights"));
}

TEST(TraceJson, SendsTheHeaviestPointsWhenAskedTo) {
  FlowTrace trace = testing::fake_trace("t1", 4, 7);
  trace.steps[1].weights[70] = 9;
  const Json json = to_json(trace, true);
  ASSERT_EQ(json["steps"][1]["weights"].size(), 64u);
  EXPECT_EQ(json["steps"][1]["weights"][0]["weight"], 9.0);
}

TEST(TraceJson, NamesTheKeyThatIsWrong) {
  Json json = to_json(testing::fake_trace("t1", 4, 7));
  json["steps"][2]["x"].erase(0);
  EXPECT_EQ(refusal([&] { trace_from_json(json); }).where, "steps[2].x");
  json = to_json(testing::fake_trace("t1", 4, 7));
  json["radius"].erase("r_0");
  EXPECT_EQ(refusal([&] { trace_from_json(json); }).where, "radius.r_0");
  json["format"] = "other/1";
  EXPECT_EQ(refusal([&] { trace_from_json(json); }).where, "format");
}

TEST(ParseBody, RefusesWhatCouldHurt) {
  EXPECT_EQ(refusal([] { parse_body(std::string(100000, '[')); }).code, "too_deep");
  EXPECT_EQ(refusal([] { parse_body(std::string(300 * 1024, ' ')); }).status, 413);
  EXPECT_EQ(refusal([] { parse_body(R"({"a":1,"a":2})"); }).code, "duplicate_key");
  EXPECT_EQ(refusal([] { parse_body("{\"a\":\"\xff\"}"); }).status, 400);
  EXPECT_EQ(refusal([] { parse_body("1e999"); }).status, 400);
  EXPECT_EQ(refusal([] { parse_body(R"({"a":"\ud800"})"); }).status, 400);
  for (const char* text : {"", "NaN", "{", "{'a':1}", "[1,]", "{\"a\":1}x", "\0"})
    EXPECT_EQ(refusal([&] { parse_body(text); }).status, 400) << text;
  std::string keys = "{";
  for (int i = 0; i < 2000; ++i) keys += "\"k" + std::to_string(i) + "\":0,";
  keys.back() = '}';
  EXPECT_EQ(refusal([&] { parse_body(keys); }).code, "too_many_keys");
}

TEST(ParseBody, RefusesWhatIsTooMuchBeforeItIsRead) {
  const std::string long_text(200'000, 'a');
  const ApiError key = refusal([&] { parse_body("{\n \"" + long_text + "\": 1}"); });
  EXPECT_EQ(key.code, "key_too_long");
  EXPECT_EQ(key.where, "line 2, column 2");
  EXPECT_EQ(refusal([&] { parse_body("{\"a\": " + std::string(200'000, '1') + "}"); }).code, "too_long");
  EXPECT_EQ(refusal([&] { parse_body("{\"a\": " + long_text + "}"); }).code, "too_long");
  std::string values = "[0";
  for (int i = 0; i < 50'000; ++i) values += ",0";
  EXPECT_EQ(refusal([&] { parse_body(values + "]"); }).code, "too_many_values");
  EXPECT_EQ(refusal([] { parse_body(std::string(100'000, '{')); }).code, "too_deep");
  std::string mixed;
  for (int i = 0; i < 40; ++i) mixed += "{\"a\":[";
  EXPECT_EQ(refusal([&] { parse_body(mixed); }).code, "too_deep");
  EXPECT_NO_THROW(
      parse_body("{\"script\": \"" + long_text + "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[\\\"{:\"}"))
      << "a value may be long";
  const ApiError half = refusal([&] { parse_body("{\"a\": \"" + long_text); });
  EXPECT_LT(std::string(half.what()).size(), 300u) << "the answer does not repeat what was sent";
}

TEST(ParseBody, SaysWhereItStopped) {
  EXPECT_EQ(refusal([] { parse_body("{\n  \"a\": ?}"); }).where, "line 2, column 8");
}

TEST(ParseBody, AllowsThirtyTwoLevels) {
  EXPECT_NO_THROW(parse_body(std::string(32, '[') + std::string(32, ']')));
  EXPECT_EQ(refusal([] { parse_body(std::string(33, '[') + std::string(33, ']')); }).code, "too_deep");
}

TEST(Dump, ReplacesBrokenText) { EXPECT_NO_THROW(dump(error_json("code", "broken \xff text", "\xc3"))); }

TEST(Requests, NameUnknownKeysAndWrongTypes) {
  EXPECT_EQ(refusal([] { predict_request(parse_body(R"({"flow_step":3})")); }).where, "flow_step");
  EXPECT_EQ(refusal([] { predict_request(parse_body(R"({"flow_steps":2.5})")); }).where, "flow_steps");
  EXPECT_EQ(refusal([] { predict_request(parse_body(R"({"flow_steps":0})")); }).where, "flow_steps");
  EXPECT_EQ(refusal([] { predict_request(parse_body(R"({"seed":-1})")); }).where, "seed");
  EXPECT_EQ(refusal([] { predict_request(parse_body(R"({"integrator":"ode45"})")); }).where, "integrator");
  EXPECT_EQ(refusal([] { predict_request(parse_body("[]")); }).where, "body");
  EXPECT_EQ(refusal([] { reset_request(parse_body("{}")); }).where, "task");
  EXPECT_EQ(refusal([] { show_request(parse_body("{}")); }).where, "step");
  EXPECT_EQ(refusal([] { branch_request(parse_body(R"({"step":1,"quaternion":[1,1,0,0]})")); }).where,
            "quaternion");
  EXPECT_EQ(refusal([] { train_request(parse_body(R"({"action":"go"})")); }).where, "action");
  EXPECT_EQ(refusal([] { export_request(parse_body(R"({"kind":"exe"})")); }).where, "kind");
}

TEST(Requests, ReadWhatTheContractNames) {
  EXPECT_EQ(predict_request(parse_body(R"({"seed":18446744073709551615})")).seed, UINT64_MAX);
  EXPECT_EQ(predict_request(parse_body("{}")).integrator, "euler");
  EXPECT_EQ(predict_request(parse_body(R"({"integrator":"rk4","samples":3})")).integrator, "rk4");
  EXPECT_EQ(show_request(parse_body(R"({"step":null})")), std::nullopt);
  EXPECT_EQ(show_request(parse_body(R"({"step":3})")), 3);
  const BranchRequest branch = branch_request(parse_body(R"({"step":2,"position":[1,2,3],"radius":0.1})"));
  EXPECT_EQ(branch.position->z(), 3);
  EXPECT_EQ(branch.radius_m, 0.1);
  const TrainRequest train = train_request(parse_body(
      R"({"action":"start","minutes":5,"preset":"nano","objective":"ddim","tasks":["a"],"point_encoder":"off"})"));
  EXPECT_TRUE(train.start);
  EXPECT_EQ(train.minutes, 5);
  EXPECT_FALSE(train.options.point_encoder);
}

TEST(Requests, ViewChangesOnlyWhatIsNamed) {
  ViewSettings settings;
  settings.camera = "front";
  ViewSettings changed = view_request(parse_body(R"({"overlays":false,"size":[320,240]})"), settings);
  EXPECT_EQ(changed.camera, "front");
  EXPECT_FALSE(changed.overlays);
  EXPECT_EQ(changed.width, 320);
  changed = view_request(parse_body(R"({"orbit":{"azimuth_deg":10,"distance":2}})"), settings);
  EXPECT_FALSE(changed.camera);
  EXPECT_EQ(changed.orbit.azimuth_deg, 10);
  EXPECT_EQ(changed.orbit.distance_m, 2);
  changed = view_request(parse_body(R"({"camera":{"elevation_deg":-40}})"), settings);
  EXPECT_FALSE(changed.camera);
  EXPECT_EQ(changed.orbit.elevation_deg, -40);
  EXPECT_EQ(view_request(to_json(settings), settings).camera, "front") << "what was read can be written back";
}

TEST(StateJson, HasTheKeysOfTheContract) {
  const Json json = to_json(StateSnapshot{});
  for (const char* key :
       {"task", "variation", "seed", "instruction", "views", "episode", "recording", "training", "policy"})
    EXPECT_TRUE(json.contains(key)) << key;
}

TEST(TrainJson, HasNoErrorWhereNothingWasHeldOut) {
  TrainReport report;
  report.left_out = {{"cut", "cut.demo: is cut short"}};
  const Json nothing = to_json(report);
  EXPECT_TRUE(nothing["validation"]["position_mm"].is_null());
  EXPECT_TRUE(nothing["validation"]["rotation_deg"].is_null());
  EXPECT_EQ(nothing["left_out"], Json::parse(R"([{"id":"cut","problem":"cut.demo: is cut short"}])"));
  report.status.validation = {12, 3, 5, {{"push_buttons", 12, 3, 5}, {"open_drawer", 0, 0, 0}}};
  const Json measured = to_json(report)["validation"];
  EXPECT_EQ(measured["position_mm"], 12);
  EXPECT_EQ(measured["tasks"][0]["rotation_deg"], 3);
  EXPECT_TRUE(measured["tasks"][1]["position_mm"].is_null());
}

TEST(JobJson, ShowsResultAndErrorOnlyWhenThereAreSome) {
  JobStatus job;
  job.state = "running";
  EXPECT_FALSE(to_json(job).contains("result"));
  EXPECT_FALSE(to_json(job).contains("error"));
  job.state = "done";
  job.url = "/exports/a.png";
  job.success = true;
  EXPECT_EQ(to_json(job)["result"]["url"], "/exports/a.png");
  EXPECT_EQ(to_json(job)["result"]["success"], true);
  job.state = "failed";
  job.error = "it fell";
  job.where = "script:3:1";
  EXPECT_EQ(to_json(job)["error"]["where"], "script:3:1");
}

}  // namespace
}  // namespace flowscope::web::wire
