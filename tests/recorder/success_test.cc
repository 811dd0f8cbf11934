#include "recorder/success.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <memory>
#include <string>

#include "recorder/success_overlap.h"
#include "tests/support/tiny_model.h"

namespace flowscope {
namespace {

/// The one geom of a body at `position` with `attributes`, against a sensor box of half size 0.1 at the
/// origin.
bool meets(const std::string& attributes, const std::string& position) {
  const auto model = shape_and_sensor(attributes, position);
  const auto data = placed_data(model.get());
  return body_overlaps(model.get(), data.get(), 1, sensor_box(model.get(), data.get(), 0));
}

TEST(Overlap, BoxesMeetAtTheirFacesEdgesAndCorners) {
  EXPECT_TRUE(meets("type='box' size='.05 .05 .05'", "0 0 0"));
  EXPECT_TRUE(meets("type='box' size='.05 .05 .05'", ".149 0 0"));
  EXPECT_FALSE(meets("type='box' size='.05 .05 .05'", ".151 0 0"));
  EXPECT_TRUE(meets("type='box' size='.05 .05 .05'", ".149 .149 .149"));
  EXPECT_FALSE(meets("type='box' size='.05 .05 .05'", ".149 .151 .149"));
  // Turned by 45 degrees its corner reaches sqrt(2) * 50 mm.
  EXPECT_TRUE(meets("type='box' size='.05 .05 .05' euler='0 0 .785398'", ".1700 0 0"));
  EXPECT_FALSE(meets("type='box' size='.05 .05 .05' euler='0 0 .785398'", ".1715 0 0"));
  EXPECT_TRUE(meets("type='box' size='1 1 1'", "0.2 0.3 0.1")) << "the sensor inside the object";
}

TEST(Overlap, RoundShapesAreRound) {
  const double corner = 0.1 + 0.05 / std::sqrt(3);
  const auto at = [](double x) {
    return std::to_string(x) + " " + std::to_string(x) + " " + std::to_string(x);
  };
  EXPECT_TRUE(meets("type='sphere' size='.05'", at(corner - 0.001)));
  EXPECT_FALSE(meets("type='sphere' size='.05'", at(corner + 0.001)));
  EXPECT_TRUE(meets("type='capsule' size='.02 .1'", "0 0 .219"));
  EXPECT_FALSE(meets("type='capsule' size='.02 .1'", "0 0 .221"));
  EXPECT_TRUE(meets("type='cylinder' size='.05 .02'", ".134 .134 0"));
  EXPECT_FALSE(meets("type='cylinder' size='.05 .02'", ".137 .137 0"));
  EXPECT_TRUE(meets("type='cylinder' size='.05 .02'", "0 0 .119"));
  EXPECT_FALSE(meets("type='cylinder' size='.05 .02'", "0 0 .121"));
  EXPECT_TRUE(meets("type='ellipsoid' size='.1 .05 .02'", ".199 0 0"));
  EXPECT_FALSE(meets("type='ellipsoid' size='.1 .05 .02'", "0 0 .121"));
}

TEST(Overlap, MeshesCountAsTheirHull) {
  EXPECT_TRUE(meets("type='mesh' mesh='pyramid'", "-.1 -.1 -.1"));
  EXPECT_FALSE(meets("type='mesh' mesh='pyramid'", ".3 0 0"));
}

TEST(Overlap, AgreesWithTheContactsOfTheEngine) {
  // Random poses of a bar against a box: the engine's own collision says whether they touch.
  const auto model = tiny_model(
      "<site name='s' type='box' size='.06 .04 .03'/><geom type='box' size='.06 .04 .03'/>"
      "<body name='b'><freejoint/><geom type='capsule' size='.015 .05'/></body>");
  const auto data = placed_data(model.get());
  unsigned state = 7;
  const auto uniform = [&state] {
    state = state * 1664525u + 1013904223u;
    return state / 4294967296.0 * 2 - 1;
  };
  int touching = 0, compared = 0;
  for (int i = 0; i < 2000; ++i) {
    for (int k = 0; k < 3; ++k) data->qpos[k] = 0.11 * uniform();
    for (int k = 3; k < 7; ++k) data->qpos[k] = uniform();
    mju_normalize4(data->qpos + 3);
    mj_kinematics(model.get(), data.get());
    mj_comPos(model.get(), data.get());
    mj_collision(model.get(), data.get());
    double deepest = 1;
    for (int k = 0; k < data->ncon; ++k) deepest = std::min(deepest, data->contact[k].dist);
    if (std::abs(deepest) < 1e-4) continue;  // too close to call
    const bool expected = deepest < 0;
    touching += expected;
    ++compared;
    EXPECT_EQ(body_overlaps(model.get(), data.get(), 1, sensor_box(model.get(), data.get(), 0)), expected)
        << i;
  }
  EXPECT_GT(touching, 300);
  EXPECT_GT(compared - touching, 300);
}

class Terms : public testing::Test {
 protected:
  std::unique_ptr<SuccessCheck> check(const std::string& yaml) {
    return make_success(reader_, reader_.parse(yaml), model_.get(), data_.get());
  }
  bool update(SuccessCheck& terms, const std::vector<std::string>& grasped = {}) {
    mj_kinematics(model_.get(), data_.get());
    return terms.update(model_.get(), data_.get(), grasped);
  }
  TaskReader reader_{"task.yaml"};
  ModelPtr model_ = tiny_model(
      "<site name='here' type='box' size='.05 .05 .05'/><site name='ball_site'/>"
      "<body name='a' pos='1 0 0'><joint name='ja' type='slide'/><geom size='.01' material='lamp'/></body>"
      "<body name='b' pos='2 0 0'><joint name='jb' type='hinge'/><geom size='.01'/></body>"
      "<body name='free'><freejoint/><geom size='.01'/></body>");
  DataPtr data_ = placed_data(model_.get());
};

TEST_F(Terms, JointsCountFromWhereTheyWere) {
  data_->qpos[0] = 0.4;
  const auto terms = check("joint: {joint: ja, beyond: 0.15}");
  EXPECT_FALSE(update(*terms));
  data_->qpos[0] = 0.56;
  EXPECT_TRUE(update(*terms));
  data_->qpos[0] = 0.24;
  EXPECT_TRUE(update(*terms)) << "either way";
  EXPECT_EQ(terms->terms().at(0).value, "160.0 mm");
}

TEST_F(Terms, OrderLatchesButDoesNotLookAhead) {
  const auto terms =
      check("in_order: [{pressed: {joint: ja, travel: 0.001}}, {joint: {joint: jb, beyond: 0.1}}]");
  data_->qpos[1] = 1;
  EXPECT_FALSE(update(*terms)) << "the second alone";
  data_->qpos[1] = 0;
  data_->qpos[0] = -0.002;
  EXPECT_FALSE(update(*terms)) << "the first";
  data_->qpos[0] = 0;
  EXPECT_FALSE(update(*terms)) << "the first sprang back";
  EXPECT_TRUE(terms->terms().at(0).met) << "and stays met";
  data_->qpos[1] = 1;
  EXPECT_TRUE(update(*terms)) << "then the second";
}

TEST_F(Terms, AllNeedsThemAtOnceAnyOne) {
  const auto all = check("all: [{joint: {joint: ja, beyond: 0.1}}, {joint: {joint: jb, beyond: 0.1}}]");
  const auto any = check("any: [{joint: {joint: ja, beyond: 0.1}}, {joint: {joint: jb, beyond: 0.1}}]");
  EXPECT_FALSE(update(*any));
  data_->qpos[0] = 1;
  EXPECT_FALSE(update(*all));
  EXPECT_TRUE(update(*any));
  data_->qpos[0] = 0;
  data_->qpos[1] = 1;
  EXPECT_FALSE(update(*all)) << "nothing is latched";
  data_->qpos[0] = 1;
  EXPECT_TRUE(update(*all));
}

TEST_F(Terms, InsideAndNearFollowTheBody) {
  const auto inside = check("inside: {body: free, sensor: here}");
  const auto near = check("near: {frame: free, to: ball_site, within: 0.02}");
  mjtNum* position = data_->qpos + 2;
  position[0] = 0.059;
  EXPECT_TRUE(update(*inside));
  EXPECT_EQ(inside->terms().at(0).value, "1.0 mm deep");
  EXPECT_FALSE(update(*near));
  position[0] = 0.061;
  EXPECT_FALSE(update(*inside));
  EXPECT_EQ(inside->terms().at(0).value, "1.0 mm outside");
  position[0] = 0.019;
  EXPECT_TRUE(update(*near));
  EXPECT_EQ(near->terms().at(0).value, "19.0 mm");
}

TEST_F(Terms, GraspedAndReleased) {
  const auto grasped = check("grasped: a"), released = check("released: a"), empty = check("released: any");
  EXPECT_FALSE(update(*grasped, {"b"}));
  EXPECT_TRUE(update(*released, {"b"}));
  EXPECT_FALSE(update(*empty, {"b"}));
  EXPECT_TRUE(update(*grasped, {"a", "b"}));
  EXPECT_FALSE(update(*released, {"a", "b"}));
  EXPECT_TRUE(update(*empty, {}));
}

TEST_F(Terms, APressedButtonTurnsGreen) {
  const auto terms = check("in_order: [{pressed: {joint: ja, travel: 0.001, material: lamp, color: green}}]");
  update(*terms);
  terms->paint(model_.get());
  EXPECT_EQ(model_->mat_rgba[0], 1);
  data_->qpos[0] = -0.002;
  update(*terms);
  data_->qpos[0] = 0;
  update(*terms);
  terms->paint(model_.get());
  EXPECT_EQ(model_->mat_rgba[0], 0);
  EXPECT_EQ(model_->mat_rgba[1], 0.5f);
}

TEST_F(Terms, ComplaintsNameThePlace) {
  const auto complaint = [&](const std::string& yaml) -> std::string {
    try {
      check(yaml);
    } catch (const BadScript& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(complaint("all:\n  - joint: {joint: jc, beyond: 0.1}").rfind("task.yaml:2:20: ", 0), 0u);
  EXPECT_NE(complaint("all:\n  - joint: {joint: jc, beyond: 0.1}").find("'jc'"), std::string::npos);
  EXPECT_NE(complaint("holds: a").find("no success term is called 'holds'"), std::string::npos);
  EXPECT_NE(complaint("joint: {joint: ja}").find("'beyond' is missing"), std::string::npos);
  EXPECT_NE(complaint("joint: {joint: ja, beyond: -1}").find("above 0"), std::string::npos);
  EXPECT_NE(complaint("inside: {body: a, sensor: ball_site}").find("is no box"), std::string::npos);
  EXPECT_NE(complaint("all: []").find("at least one"), std::string::npos);
}

}  // namespace
}  // namespace flowscope
