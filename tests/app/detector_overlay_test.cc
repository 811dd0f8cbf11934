// Success terms as things to draw, and as numbers in what record prints.
#include "app/detector_overlay.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "recorder/record.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

Detector box(const std::string& name, bool met, double x) {
  Detector d;
  d.name = name;
  d.place = "bin";
  d.met = met;
  d.world_from_shape.position.x() = x;
  d.half_size.setConstant(0.1);
  d.subject = Eigen::Vector3d(1, 1, 1);
  return d;
}

TEST(DetectorOverlay, ColoursAndNamesEachVolume) {
  Detector sphere = box("ring near spoke", true, 0.5);
  sphere.shape = Detector::Shape::sphere;
  Detector way;
  way.name = "joint lid";
  way.shape = Detector::Shape::track;
  way.track = {{0, 0, 0}, {0, 0, 1}, {0, 0, 2}};
  way.reached = 0.75;
  const Overlay overlay = overlay_of({box("ball inside bin", false, 0), sphere, way});
  ASSERT_EQ(overlay.boxes.size(), 1u);
  EXPECT_EQ(overlay.boxes[0].color, palette::unmet);
  ASSERT_EQ(overlay.spheres.size(), 1u);
  EXPECT_EQ(overlay.spheres[0].color, palette::met);
  EXPECT_EQ(overlay.spheres[0].radius_m, 0.1);
  ASSERT_EQ(overlay.labels.size(), 3u);
  EXPECT_EQ(overlay.labels[0].text, "ball inside bin");
  EXPECT_NEAR(overlay.labels[0].position.z(), 0.1, 1e-12);
  ASSERT_EQ(overlay.lines.size(), 3u) << "the ball's way to the bin; the lid's in full and as far as it is";
  EXPECT_TRUE(overlay.lines[2].points.back().isApprox(Eigen::Vector3d(0, 0, 1.5)));
}

TEST(DetectorOverlay, TermsThatWatchOneVolumeShareIt) {
  const Overlay overlay = overlay_of({box("a inside bin", false, 0), box("b inside bin", true, 0),
                                      box("a inside bin", false, 0), box("a inside bin", false, 1)});
  ASSERT_EQ(overlay.boxes.size(), 2u);
  EXPECT_EQ(overlay.boxes[0].color, palette::met);
  EXPECT_EQ(overlay.labels[0].text, "bin: 1 of 2");
  EXPECT_EQ(overlay.boxes[1].color, palette::unmet);
  EXPECT_EQ(overlay.labels[1].text, "a inside bin");
}

TEST(DetectorOverlay, AReplayKeepsWhatWasLatchedOnTheWay) {
  const TaskLibrary tasks(find_assets());
  World world(tasks.get("push_buttons"));
  world.reset(0, 1);
  const auto none = [](const SceneState&) { return Observation{}; };
  const RunReport run = run_script(world, world.episode().demonstration, none);
  ASSERT_TRUE(run.success) << run.reason;
  const auto met = [](const Overlay& overlay) {
    int count = 0;
    for (const auto& point : overlay.points) count += point.color[1] == palette::met[1];
    return count;
  };
  const std::size_t last = run.demo->frames.size() - 1;
  const Overlay begin = detectors_of(tasks, *run.demo, 0), end = detectors_of(tasks, *run.demo, last);
  EXPECT_EQ(met(begin), 0);
  EXPECT_EQ(met(end), 1);
  EXPECT_EQ(end.labels.size(), 1u);
}

class RecordJson : public ::testing::Test {
 protected:
  nlohmann::json run(const std::vector<std::string>& more) {
    std::vector<std::string> call{"record", "open_drawer", "--data", folder_.path().string(), "--json"};
    call.insert(call.end(), more.begin(), more.end());
    return nlohmann::json::parse(testing::run_command(call).out);
  }
  testing::TemporaryFolder folder_;
};

TEST_F(RecordJson, ShowsEveryTermAtEveryMoment) {
  const auto document = run({"--seed", "1"});
  ASSERT_EQ(document.at("saved"), 1);
  EXPECT_EQ(document.at("frame_seconds"), 0.05);
  const auto& attempt = document.at("attempts").at(0);
  EXPECT_EQ(attempt.at("seed"), 1);
  EXPECT_TRUE(attempt.at("success"));
  const auto& term = attempt.at("terms").at(0);
  EXPECT_EQ(term.at("unit"), "m");
  EXPECT_EQ(term.at("wanted"), "above");
  EXPECT_TRUE(term.at("met_at_end"));
  const auto values = term.at("values").get<std::vector<double>>();
  const double seconds = document.at("sim_seconds");
  EXPECT_NEAR(static_cast<double>(values.size() - 1) * 0.05, seconds, 1e-6);
  EXPECT_LT(values.front(), 1e-3);
  EXPECT_GT(values.back(), term.at("threshold").get<double>());
  const auto moment = static_cast<std::size_t>(term.at("first_met_s").get<double>() / 0.05);
  EXPECT_LE(values.at(moment), term.at("threshold").get<double>());
  EXPECT_GT(values.at(moment + 1), term.at("threshold").get<double>());
}

TEST_F(RecordJson, AlsoOfARunThatFails) {
  const auto script = folder_.path() / "idle.yaml";
  std::ofstream(script) << "steps:\n  - gripper: close\n";
  const auto document = run({"--script", script.string()});
  EXPECT_EQ(document.at("saved"), 0);
  const auto& attempt = document.at("attempts").at(0);
  EXPECT_FALSE(attempt.at("success"));
  const auto& term = attempt.at("terms").at(0);
  EXPECT_FALSE(term.at("met_at_end"));
  EXPECT_TRUE(term.at("first_met_s").is_null());
  EXPECT_GT(term.at("values").size(), 10u);
  EXPECT_FALSE(run({"--script", script.string(), "--no-terms"}).contains("attempts"));
}

}  // namespace
}  // namespace flowscope
