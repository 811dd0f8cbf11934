#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/served_fake.h"
#include "web/requests.h"

namespace flowscope::web {
namespace {

using testing::ServedFake;
using wire::Json;

std::string refused(const std::function<void()>& call) {
  try {
    call();
  } catch (const ApiError& error) {
    return std::to_string(error.status) + " " + error.where;
  }
  return "";
}

TEST(TeleopRequests, NameTheKeyThatIsWrong) {
  const auto jog = [](const char* text) { return [text] { wire::jog_request(Json::parse(text)); }; };
  EXPECT_EQ(refused(jog(R"({"linear":[0,0]})")), "400 linear");
  EXPECT_EQ(refused(jog(R"({"linear":[0,0,11]})")), "400 linear");
  EXPECT_EQ(refused(jog(R"({"frame":"base"})")), "400 frame");
  EXPECT_EQ(refused(jog(R"({"sideways":1})")), "400 sideways");
  EXPECT_EQ(refused([] { wire::pick_request(Json::parse(R"({"u":1.5,"v":0})"), "main"); }), "400 u");
  EXPECT_EQ(refused([] { wire::waypoints_request(Json::parse(R"({"script":"","selected":-1})")); }),
            "400 selected");
  EXPECT_EQ(refused([] { wire::gripper_request(Json::parse(R"({"openness":2})")); }), "400 openness");
  EXPECT_EQ(refused([] { wire::gripper_request(Json::parse("{}")); }), "400 openness");

  const JogRequest request =
      wire::jog_request(Json::parse(R"({"linear":[0,0,0.1],"frame":"tool","may_touch":true})"));
  EXPECT_EQ(request.linear_m_s.z(), 0.1);
  EXPECT_TRUE(request.in_tool_frame && request.may_touch);
  EXPECT_FALSE(wire::save_request(Json::parse("{}")));
}

TEST(TeleopRoutes, CarryAHandAndItsWaypoints) {
  const ServedFake served;
  const auto json = [](const testing::Reply& reply) { return Json::parse(reply.body); };
  const Json camera = json(served.get("/api/v1/views/main/camera"));
  EXPECT_EQ(camera["width"], 640);
  const Json picked = json(served.send("POST", "/api/v1/views/main/pick", R"({"u":0.5,"v":0.8})"));
  ASSERT_EQ(picked["proposals"][0]["approach"], "above");
  EXPECT_EQ(picked["proposals"][0]["step"]["kind"], "move");
  EXPECT_EQ(served.send("POST", "/api/v1/views/main/pick", R"({"u":0.5,"v":0})").status, 404);
  EXPECT_EQ(served.send("POST", "/api/v1/views/nose/pick", R"({"u":0.5,"v":0.5})").status, 404);

  const Json steps = json(served.send(
      "PUT", "/api/v1/waypoints",
      R"({"script":"steps:\n  - move: {frame: world, position: [0.3, 0, 0.9], rpy_deg: [180, 0, 0]}\n  - gripper: close\n"})"))
      ["steps"];
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_EQ(steps[0]["line"], 2);
  EXPECT_EQ(steps[0]["world"]["position"][0], 0.3);
  EXPECT_EQ(steps[1]["openness"], 0);
  EXPECT_EQ(json(served.send("PUT", "/api/v1/waypoints", R"({"script":""})"))["steps"].size(), 0u);
  EXPECT_EQ(served.send("PUT", "/api/v1/waypoints", R"({"script":"steps: []"})").status, 400);

  EXPECT_EQ(served.send("POST", "/api/v1/teleop/undo").status, 409);
  EXPECT_EQ(json(served.send("POST", "/api/v1/teleop/jog", R"({"linear":[0,0,0.1]})"))["jog"], "moving");
  EXPECT_EQ(json(served.send("POST", "/api/v1/teleop/jog", R"({})"))["jog"], "still");
  EXPECT_EQ(json(served.get("/api/v1/teleop"))["strokes"], 1);
  EXPECT_EQ(json(served.send("POST", "/api/v1/teleop/gripper", R"({"openness":0})"))["openness"], 0);
  EXPECT_EQ(json(served.send("POST", "/api/v1/teleop/mark"))["steps"].size(), 2u);
  EXPECT_EQ(served.send("POST", "/api/v1/teleop/save").status, 409) << "not done: it must be asked for";
  EXPECT_EQ(json(served.send("POST", "/api/v1/teleop/save", R"({"unfinished":true})"))["demo"],
            "push_buttons-0001");
}

}  // namespace
}  // namespace flowscope::web
