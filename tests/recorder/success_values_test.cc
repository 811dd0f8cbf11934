// The numbers behind success terms, against geometry worked out by hand.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <numbers>

#include "recorder/convex_gap.h"
#include "recorder/success.h"
#include "recorder/success_overlap.h"
#include "recorder/term_series.h"
#include "tests/support/tiny_model.h"

namespace flowscope {
namespace {

/// Gap between the one geom of a body and a sensor box of half size 0.1 at the origin, millimetres.
double gap_mm(const std::string& attributes, const std::string& position) {
  const auto model = shape_and_sensor(attributes, position);
  const auto data = placed_data(model.get());
  return 1000 * body_gap(model.get(), data.get(), 1, sensor_box(model.get(), data.get(), 0));
}

TEST(Gap, OutsideItIsTheDistanceToTheNearestFaceEdgeOrCorner) {
  EXPECT_NEAR(gap_mm("type='sphere' size='.05'", ".2 0 0"), 50, 0.01);
  EXPECT_NEAR(gap_mm("type='sphere' size='.05'", ".2 .2 0"), 1000 * 0.1 * std::sqrt(2) - 50, 0.01);
  EXPECT_NEAR(gap_mm("type='sphere' size='.05'", ".2 .2 .2"), 1000 * 0.1 * std::sqrt(3) - 50, 0.01);
  EXPECT_NEAR(gap_mm("type='box' size='.05 .05 .05'", ".18 .02 0"), 30, 0.01);
  EXPECT_NEAR(gap_mm("type='box' size='.05 .05 .05' euler='0 0 .78539816'", ".2 0 0"),
              100 - 50 * std::sqrt(2), 0.01);
  EXPECT_NEAR(gap_mm("type='capsule' size='.02 .1'", "0 0 .25"), 30, 0.01);
  EXPECT_NEAR(gap_mm("type='cylinder' size='.05 .02'", "0 .2 .15"), 1000 * std::hypot(0.05, 0.03), 0.02);
  EXPECT_NEAR(gap_mm("type='ellipsoid' size='.1 .05 .02'", ".25 0 0"), 50, 0.01);
  EXPECT_NEAR(gap_mm("type='mesh' mesh='pyramid'", ".3 0 0"), 200, 0.01);
}

TEST(Gap, InsideItIsTheShortestWayOut) {
  EXPECT_NEAR(gap_mm("type='sphere' size='.05'", ".12 0 0"), -30, 0.05);
  EXPECT_NEAR(gap_mm("type='sphere' size='.01'", "0 .06 0"), -50, 0.05);
  EXPECT_NEAR(gap_mm("type='box' size='.05 .04 .03'", ".1 .09 .11"), -20, 0.01);
  EXPECT_NEAR(gap_mm("type='box' size='.05 .05 .05'", "0 0 0"), -150, 0.01);
  EXPECT_NEAR(gap_mm("type='box' size='1 1 .02'", "0.2 0.3 0.1"), -20, 0.01) << "the sensor sticks into it";
  EXPECT_NEAR(gap_mm("type='cylinder' size='.05 .02'", "0 0 .1"), -20, 0.05);
}

TEST(Gap, AgreesWithWhatOverlapsSaysAndWithShifts) {
  // Anywhere: the sign is the overlap's; and shifted by the gap along any way, nothing can come nearer than
  // that.
  const auto model = tiny_model(
      "<site name='s' type='box' size='.06 .04 .03'/>"
      "<body name='b'><freejoint/><geom type='capsule' size='.015 .05'/></body>");
  const auto data = placed_data(model.get());
  const SensorBox box = sensor_box(model.get(), data.get(), 0);
  unsigned state = 3;
  const auto uniform = [&state] {
    state = state * 1664525u + 1013904223u;
    return state / 4294967296.0 * 2 - 1;
  };
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    for (int k = 0; k < 3; ++k) data->qpos[k] = 0.11 * uniform();
    for (int k = 3; k < 7; ++k) data->qpos[k] = uniform();
    mju_normalize4(data->qpos + 3);
    mj_kinematics(model.get(), data.get());
    const double gap = body_gap(model.get(), data.get(), 1, box);
    if (std::abs(gap) < 1e-5) continue;
    ASSERT_EQ(gap < 0, body_overlaps(model.get(), data.get(), 1, box)) << i << ": " << gap;
    inside += gap < 0;
    Eigen::Vector3d shift(uniform(), uniform(), uniform());
    shift *= 0.9 * std::abs(gap) / shift.norm();
    for (int k = 0; k < 3; ++k) data->qpos[k] += shift[k];
    mj_kinematics(model.get(), data.get());
    const double after = body_gap(model.get(), data.get(), 1, box);
    ASSERT_EQ(after < 0, gap < 0) << i;
    ASSERT_NEAR(after, gap, shift.norm() + 2e-5) << i;
  }
  EXPECT_GT(inside, 300);
}

class Values : public testing::Test {
 protected:
  std::unique_ptr<SuccessCheck> check(const std::string& yaml) {
    return make_success(reader_, reader_.parse(yaml), model_.get(), data_.get());
  }
  bool update(SuccessCheck& terms, double time_s, const std::vector<std::string>& grasped = {}) {
    data_->time = time_s;
    mj_kinematics(model_.get(), data_.get());
    return terms.update(model_.get(), data_.get(), grasped);
  }
  TaskReader reader_{"task.yaml"};
  ModelPtr model_ = tiny_model(
      "<site name='here' type='box' size='.05 .05 .05' pos='0 0 1'/><site name='there' pos='0 0 .5'/>"
      "<body name='a' pos='1 0 0'><joint name='ja' type='slide' axis='0 0 1'/><geom size='.01'/></body>"
      "<body name='b' pos='2 0 0'><joint name='jb' type='hinge' axis='0 0 1'/><geom size='.01' pos='.2 0 "
      "0'/></body>"
      "<body name='free'><freejoint/><geom size='.01'/></body>");
  DataPtr data_ = placed_data(model_.get());
};

TEST_F(Values, EveryTermHasANumberAThresholdAndAUnit) {
  const auto terms = check(
      "all: [{joint: {joint: ja, beyond: 0.15}}, {pressed: {joint: jb, travel: 0.5}}, {inside: {body: free, "
      "sensor: here}},"
      " {near: {frame: free, to: there, within: 0.02}}, {grasped: a}, {released: any}]");
  data_->qpos[0] = -0.16;
  data_->qpos[1] = 0.25;
  data_->qpos[4] = 1.08;
  update(*terms, 0, {"a"});
  const auto list = terms->terms();
  ASSERT_EQ(list.size(), 6u);
  const auto expect = [&](std::size_t i, bool met, double value, double threshold, const char* unit,
                          bool above) {
    ASSERT_TRUE(list[i].measure.has_value()) << i;
    const TermMeasure& measure = *list[i].measure;
    EXPECT_EQ(list[i].met, met) << i;
    EXPECT_NEAR(measure.value, value, 2e-6) << i;
    EXPECT_EQ(measure.threshold, threshold) << i;
    EXPECT_EQ(measure.unit, unit) << i;
    EXPECT_EQ(measure.above, above) << i;
    EXPECT_EQ(list[i].met, above ? measure.value > threshold : measure.value <= threshold) << i;
    EXPECT_EQ(list[i].path, "all/" + std::to_string(i));
  };
  expect(0, true, 0.16, 0.15, "m", true);
  expect(1, false, 0.25, 0.5, "rad", true);
  expect(2, false, 0.02, 0, "m", false);
  expect(3, false, 0.58, 0.02, "m", false);
  expect(4, true, 1, 0, "", true);
  expect(5, false, 1, 0, "", false);
}

TEST_F(Values, PathsNameThePlaceInTheTreeAndTimesTheFirstMoment) {
  const auto terms = check(
      "all: [{any: [{joint: {joint: ja, beyond: 0.1}}, {joint: {joint: jb, beyond: 0.1}}]},"
      " {in_order: [{grasped: a}, {released: a}]}]");
  update(*terms, 1.0);
  data_->qpos[1] = 0.2;
  update(*terms, 1.5, {"a"});
  data_->qpos[1] = 0.0;
  update(*terms, 2.0, {"a"});
  EXPECT_FALSE(terms->terms().at(3).first_met_s.has_value());
  data_->qpos[1] = 0.2;
  EXPECT_TRUE(update(*terms, 2.5, {}));
  const auto list = terms->terms();
  ASSERT_EQ(list.size(), 4u);
  EXPECT_EQ(list[0].path, "all/0/any/0");
  EXPECT_EQ(list[1].path, "all/0/any/1");
  EXPECT_EQ(list[2].path, "all/1/in_order/0");
  EXPECT_EQ(list[3].path, "all/1/in_order/1");
  EXPECT_FALSE(list[0].first_met_s.has_value());
  EXPECT_EQ(list[1].first_met_s, 1.5) << "the first time, though it ceased to hold";
  EXPECT_EQ(list[2].first_met_s, 1.5);
  EXPECT_EQ(list[3].first_met_s, 2.5) << "released from the start, but its turn came later";
  EXPECT_TRUE(list[2].met) << "latched";
  EXPECT_EQ(list[2].value, "free") << "what is measured goes on living";
}

TEST_F(Values, OrderShowsWhatIsStillToCome) {
  const auto terms =
      check("in_order: [{pressed: {joint: ja, travel: 0.001}}, {joint: {joint: jb, beyond: 0.1}}]");
  data_->qpos[1] = 1;
  update(*terms, 0);
  EXPECT_NEAR(terms->terms().at(1).measure->value, 1, 1e-9);
  EXPECT_FALSE(terms->terms().at(1).met) << "its turn has not come";
}

TEST_F(Values, DetectorsStandWhereTheSensorsAre) {
  const auto terms = check(
      "all: [{inside: {body: free, sensor: here}}, {near: {frame: free, to: there, within: 0.02}},"
      " {joint: {joint: ja, beyond: 0.15}}, {joint: {joint: jb, beyond: 1.5707963267948966}}, {grasped: a}]");
  data_->qpos[0] = 0.06;
  data_->qpos[1] = 0.78539816339744828;
  data_->qpos[4] = 0.49;
  update(*terms, 0);
  const auto detectors = terms->detectors();
  ASSERT_EQ(detectors.size(), 4u) << "what is held has no place";
  EXPECT_EQ(detectors[0].shape, Detector::Shape::box);
  EXPECT_TRUE(detectors[0].world_from_shape.position.isApprox(Eigen::Vector3d(0, 0, 1)));
  EXPECT_TRUE(detectors[0].half_size.isApprox(Eigen::Vector3d::Constant(0.05)));
  EXPECT_FALSE(detectors[0].met);
  EXPECT_EQ(detectors[1].shape, Detector::Shape::sphere);
  EXPECT_TRUE(detectors[1].met);
  EXPECT_EQ(detectors[1].name, "free near there");
  EXPECT_EQ(detectors[1].half_size.x(), 0.02);
  EXPECT_TRUE(detectors[1].subject->isApprox(Eigen::Vector3d(0, 0, 0.49)));
  const auto& slide = detectors[2];
  EXPECT_TRUE(slide.track.front().isApprox(Eigen::Vector3d(1, 0, 0), 1e-9))
      << slide.track.front().transpose();
  EXPECT_TRUE(slide.track.back().isApprox(Eigen::Vector3d(1, 0, 0.15), 1e-9))
      << slide.track.back().transpose();
  EXPECT_NEAR(slide.reached, 0.4, 1e-9);
  const auto& hinge = detectors[3];
  EXPECT_TRUE(hinge.track.front().isApprox(Eigen::Vector3d(2.2, 0, 0), 1e-9))
      << hinge.track.front().transpose();
  EXPECT_TRUE(hinge.track.back().isApprox(Eigen::Vector3d(2, 0.2, 0), 1e-9))
      << hinge.track.back().transpose();
  EXPECT_NEAR(hinge.reached, 0.5, 1e-9);
}

TEST_F(Values, ASeriesHasOneValuePerFrame) {
  const auto terms = check("joint: {joint: ja, beyond: 0.15}");
  std::vector<TermSeries> series;
  for (int i = 0; i < 5; ++i) {
    data_->qpos[0] = i == 4 ? 0.0 : 0.06 * i;
    update(*terms, 0.05 * i);
    append_terms(terms->terms(), series);
  }
  ASSERT_EQ(series.size(), 1u);
  ASSERT_EQ(series[0].values.size(), 5u);
  EXPECT_NEAR(series[0].values[3], 0.18, 1e-9);
  EXPECT_EQ(series[0].at_end.threshold, 0.15);
  EXPECT_EQ(series[0].path, "");
  EXPECT_EQ(series[0].first_met_s, 0.05 * 3);
  EXPECT_FALSE(series[0].met_at_end);
}

}  // namespace
}  // namespace flowscope
