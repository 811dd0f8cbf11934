#include "recorder/pick.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "recorder/script_poses.h"
#include "recorder/world.h"

namespace flowscope {
namespace {

std::unique_ptr<World> world_of(const std::string& task, std::uint64_t seed = 3) {
  static const TaskLibrary library(find_assets());
  auto world = std::make_unique<World>(library.get(task));
  world->reset(0, seed);
  return world;
}

/// The pixel in which a point of the world is seen, and what is there.
std::optional<Picked> pick_towards(const World& world, const OrbitCamera& orbit,
                                   const Eigen::Vector3d& point) {
  const CameraModel camera = orbit.model(640, 480);
  const Eigen::Vector3d uvz = camera.project(point);
  return pick(world, camera, uvz.x(), uvz.y());
}

/// Looks at a point from the side away from the robot, where its arm hides nothing.
OrbitCamera facing(const Eigen::Vector3d& point) {
  OrbitCamera orbit;
  orbit.azimuth_deg = 180;
  orbit.elevation_deg = -50;
  orbit.distance_m = 0.9;
  orbit.lookat = point;
  return orbit;
}

TEST(Pick, FindsTheButtonsThatThePictureShows) {
  const auto world = world_of("push_buttons");
  for (const char* name : {"button_1_top", "button_2_top", "button_3_top"}) {
    const Eigen::Vector3d top = world->world_from(name).position;
    const auto picked = pick_towards(*world, facing(top + Eigen::Vector3d(0.05, 0.05, 0)), top);
    ASSERT_TRUE(picked) << name;
    EXPECT_LT((picked->point - top).norm(), 0.001) << name;
    EXPECT_GT(picked->normal.z(), 0.999) << name;
    EXPECT_EQ(picked->body + "_", std::string(name).substr(0, 8) + "_cap_");
  }
}

TEST(Pick, TellsWhenNothingIsThere) {
  const auto world = world_of("push_buttons");
  OrbitCamera up;  // above the arm, and looking further up
  up.lookat = {0, 0, 4};
  up.elevation_deg = 60;
  EXPECT_FALSE(pick(*world, up.model(640, 480), 320, 240));
}

TEST(Pick, ProposesWaypointsThatFollowTheThing) {
  const auto world = world_of("push_buttons");
  const Eigen::Vector3d top = world->world_from("button_2_top").position;
  const auto picked = pick_towards(*world, facing(top), top + Eigen::Vector3d(0.012, 0.004, 0));
  ASSERT_TRUE(picked);
  const Pose tool = world->robot().world_from_tool;
  const auto proposals = propose_waypoints(*world, *picked, tool);
  ASSERT_EQ(proposals.size(), 3u);
  EXPECT_EQ(proposals[0].approach, "above");
  EXPECT_EQ(proposals[2].approach, "middle");
  EXPECT_LT((proposals[0].world_from_tool.position - picked->point).norm(), 0.01);
  EXPECT_LT((proposals[2].world_from_tool.position - top).norm(), 0.006);
  EXPECT_EQ(proposals[2].move.yaw_symmetry, 0) << "a round cap has no yaw";
  for (const auto& proposal : proposals) {
    EXPECT_LT(
        (proposal.world_from_tool.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(),
        1e-3);
    EXPECT_LT(
        rotation_error_rad(place_move(*world, proposal.move, tool).world_from_tool, proposal.world_from_tool),
        1e-6);
  }
  const auto choices = place_choices(*world, proposals[2].move, tool);
  ASSERT_EQ(choices.size(), 12u);
  EXPECT_LT(rotation_error_rad(choices[0].world_from_tool, proposals[2].world_from_tool), 1e-6);
  for (std::size_t k = 1; k < choices.size(); ++k) {
    EXPECT_LT(position_error_m(choices[k].world_from_tool, choices[0].world_from_tool), 1e-9);
    EXPECT_GE(rotation_error_rad(choices[k].world_from_tool, tool),
              rotation_error_rad(choices[k - 1].world_from_tool, tool) - 1e-9);
  }
  // On another placement it lies at the same place of the button.
  const Eigen::Vector3d in_button =
      world->world_from("button_2").inverse() * proposals[0].world_from_tool.position;
  const auto other = world_of("push_buttons", 8);
  const Pose there = place_move(*other, proposals[0].move, tool).world_from_tool;
  EXPECT_GT((there.position - proposals[0].world_from_tool.position).norm(), 0.01);
  EXPECT_LT((other->world_from("button_2").inverse() * there.position - in_button).norm(), 1e-9);
}

TEST(Pick, ComesToAFrontAlongItsNormal) {
  const auto world = world_of("open_drawer");
  const Pose handle = world->world_from("drawer_bottom_handle");
  const auto frames = scene_frames(*world);
  EXPECT_TRUE(
      std::ranges::any_of(frames, [](const NamedFrame& f) { return f.name == "drawer_bottom_handle"; }));
  // Some pixel around the handle shows an upright face: the normal must be level there.
  OrbitCamera orbit;
  orbit.lookat = handle.position;
  orbit.distance_m = 0.5;
  orbit.elevation_deg = -20;
  int upright = 0;
  for (int azimuth = 0; azimuth < 360; azimuth += 30) {
    orbit.azimuth_deg = azimuth;
    for (const double z : {-0.05, 0.05}) {
      const auto picked = pick_towards(*world, orbit, handle.position + Eigen::Vector3d(0, 0, z));
      if (!picked || std::abs(picked->normal.z()) > 0.01) continue;
      ++upright;
      const auto proposals = propose_waypoints(*world, *picked, world->robot().world_from_tool);
      EXPECT_LT((proposals[1].world_from_tool.rotation * Eigen::Vector3d::UnitZ() + picked->normal).norm(),
                0.02);
    }
  }
  EXPECT_GT(upright, 0);
}

TEST(Pick, TheRobotIsNoFrameToFollow) {
  const auto world = world_of("push_buttons");
  const Eigen::Vector3d hand = world->world_from("hand").position;
  const auto picked = pick_towards(*world, facing(hand), hand);
  ASSERT_TRUE(picked);
  for (const auto& proposal : propose_waypoints(*world, *picked, world->robot().world_from_tool))
    EXPECT_EQ(proposal.move.frame, "world");
}

TEST(ScriptPoses, StepsStartWhereTheOneBeforeEnds) {
  const auto world = world_of("push_buttons");
  const Script script = parse_script(
      "steps:\n"
      "  - move: {frame: button_1, position: [0, 0, 0.1], rpy_deg: [180, 0, 0]}\n"
      "  - gripper: close\n"
      "  - move: {frame: tool, position: [0, 0, 0.05], rpy_deg: [0, 0, 0]}\n"
      "  - move: {frame: nowhere, position: [0, 0, 0], rpy_deg: [0, 0, 0]}\n");
  const auto placed = place_script(*world, script, world->robot().world_from_tool, 1);
  ASSERT_EQ(placed.size(), 4u);
  const Eigen::Vector3d above = world->world_from("button_1").position + Eigen::Vector3d(0, 0, 0.1);
  EXPECT_LT((placed[0].move->world_from_tool.position - above).norm(), 1e-9);
  EXPECT_FALSE(placed[1].move);
  EXPECT_LT((placed[2].move->world_from_tool.position - above + Eigen::Vector3d(0, 0, 0.05)).norm(), 1e-9);
  EXPECT_EQ(placed[0].openness, 1);
  EXPECT_EQ(placed[2].openness, 0);
  EXPECT_NE(placed[3].problem.find("nowhere"), std::string::npos);
}

}  // namespace
}  // namespace flowscope
