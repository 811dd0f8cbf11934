// The checker's shortcuts against the engine's own whole collision pass.
#include "recorder/motion/collision.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <map>

#include "recorder/motion/ik_recovery.h"
#include "recorder/motion/motion.h"
#include "recorder/motion/trajectory.h"
#include "render/mujoco_owners.h"

namespace flowscope {
namespace {

/// Kinematics and collisions of the whole scene, all contacts looked at: slow and plain.
class PlainChecker {
 public:
  explicit PlainChecker(const World& world)
      : copy_(mj_copyModel(nullptr, world.model())),
        model_(copy_.get()),
        data_(mj_copyData(nullptr, model_, world.data())),
        arm_(find_arm(model_, world.task().robot())) {
    mj_kinematics(model_, data_.get());
    for (const auto& name : world.grasped()) {
      held_.push_back(mj_name2id(model_, mjOBJ_BODY, name.c_str()));
      for (int geom = 0; geom < model_->ngeom; ++geom) {
        if (model_->geom_bodyid[geom] == held_.back()) copy_->geom_margin[geom] = kSeen_m;
      }
      const int joint = model_->body_jntadr[held_.back()];
      free_.push_back(joint >= 0 && model_->jnt_type[joint] == mjJNT_FREE);
      hand_from_held_.push_back(pose(hand()).inverse() * pose(held_.back()));
    }
    JointVector start{};
    for (std::size_t i = 0; i < arm_.joints; ++i) start[i] = data_->qpos[arm_.qpos[i]];
    collide(start);
    for (int i = 0; i < data_->ncon; ++i) {
      const mjContact& c = data_->contact[i];
      double& depth = at_start_[std::minmax(c.geom1, c.geom2)];
      depth = std::max(depth, -c.dist);
    }
  }

  bool is_free(const JointVector& q, double depth_m = 0.001) {
    collide(q);
    for (int i = 0; i < data_->ncon; ++i) {
      const mjContact& c = data_->contact[i];
      const int body1 = model_->geom_bodyid[c.geom1], body2 = model_->geom_bodyid[c.geom2];
      if (!(moves(body1) || moves(body2)) || (in_hand(body1) && in_hand(body2))) continue;
      const auto known = at_start_.find(std::minmax(c.geom1, c.geom2));
      if (-c.dist > (known == at_start_.end() ? 0 : known->second) + depth_m) return false;
    }
    return true;
  }

  /// From what is held and goes along to the nearest thing that stands still, metres, at most kSeen_m.
  double carried_distance_m(const JointVector& q) {
    collide(q);
    double nearest = kSeen_m;
    for (int i = 0; i < data_->ncon; ++i) {
      const mjContact& c = data_->contact[i];
      const int body1 = model_->geom_bodyid[c.geom1], body2 = model_->geom_bodyid[c.geom2];
      if ((carried(body1) && !moves(body2)) || (carried(body2) && !moves(body1)))
        nearest = std::min(nearest, c.dist);
    }
    return nearest;
  }

 private:
  static constexpr double kSeen_m = CollisionChecker::carried_clearance_m;
  bool carried(int body) const { return moves(body) && !below(body, model_->jnt_bodyid[arm_.joint[0]]); }
  int hand() const { return model_->site_bodyid[arm_.tool_site]; }
  bool below(int body, int ancestor) const {
    while (body != 0 && body != ancestor) body = model_->body_parentid[body];
    return body == ancestor;
  }
  bool moves(int body) const {
    bool result = below(body, model_->jnt_bodyid[arm_.joint[0]]);
    for (std::size_t i = 0; i < held_.size(); ++i) result = result || (free_[i] && below(body, held_[i]));
    return result;
  }
  bool in_hand(int body) const {
    bool result = below(body, hand());
    for (const int held : held_) result = result || below(body, held);
    return result;
  }
  Pose pose(int body) const {
    const double *p = data_->xpos + 3 * body, *r = data_->xquat + 4 * body;
    return Pose::from_wxyz({p[0], p[1], p[2]}, {r[0], r[1], r[2], r[3]});
  }
  void collide(const JointVector& q) {
    for (std::size_t i = 0; i < arm_.joints; ++i) data_->qpos[arm_.qpos[i]] = q[i];
    mj_kinematics(model_, data_.get());
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (!free_[i]) continue;
      const Pose there = pose(hand()) * hand_from_held_[i];
      double* qpos = data_->qpos + model_->jnt_qposadr[model_->body_jntadr[held_[i]]];
      const Eigen::Vector4d wxyz = there.wxyz();
      std::copy_n(there.position.data(), 3, qpos);
      std::copy_n(wxyz.data(), 4, qpos + 3);
    }
    mj_kinematics(model_, data_.get());
    mj_comPos(model_, data_.get());
    mj_collision(model_, data_.get());
  }

  ModelPtr copy_;
  const mjModel* model_;
  DataPtr data_;
  ArmIndices arm_;
  std::vector<int> held_;
  std::vector<bool> free_;
  std::vector<Pose> hand_from_held_;
  std::map<std::pair<int, int>, double> at_start_;
};

const TaskLibrary& library() {
  static const TaskLibrary tasks(find_assets());
  return tasks;
}

/// Half of them near a posture that is likely to touch, the others anywhere.
void compare(const World& world, int count, std::uint64_t seed) {
  const JointLimits limits = Kinematics::from_model(world.model(), world.task().robot()).limits();
  const JointVector here = world.frame().q;
  CollisionChecker checker(world);
  PlainChecker plain(world);
  int free = 0;
  for (int i = 0; i < count; ++i) {
    JointVector q = random_posture(limits, seed, static_cast<std::uint64_t>(i));
    if (i % 2 == 0) {
      for (std::size_t k = 0; k < q.size(); ++k) q[k] = std::lerp(here[k], q[k], 0.15);
    }
    const bool expected = plain.is_free(q);
    free += expected;
    ASSERT_EQ(checker.is_free(q), expected) << i << ": " << checker.describe(q);
    ASSERT_TRUE(expected || !checker.describe(q).empty());
    ASSERT_TRUE(expected || !checker.is_clear(q));
    if (expected) {
      ASSERT_TRUE(checker.links_are_free(q));
    }
  }
  EXPECT_GT(free, count / 10);
  EXPECT_LT(free, count);
}

class Collision : public ::testing::TestWithParam<std::string> {};

TEST_P(Collision, AgreesWithTheEnginesWholePass) {
  World world(library().get(GetParam()));
  world.reset(0, 5);
  compare(world, 300, 1);
}

INSTANTIATE_TEST_SUITE_P(AllTasks, Collision, ::testing::ValuesIn(library().names()),
                         [](const auto& test) { return test.param; });

/// Eight blocks about the table, the first of them in the hand.
class WithABlockInTheHand : public ::testing::Test {
 protected:
  void SetUp() override {
    world_.reset(0, 2);
    const Pose block = world_.world_from("block_1");
    ASSERT_TRUE(move_to(world_, above(block.position, 0.1), {}));
    MoveRequest down = above(block.position, 0);
    down.linear = down.ignore_collisions = true;
    ASSERT_TRUE(move_to(world_, down, {}));
    ASSERT_TRUE(move_gripper(world_, 0, {}));
    ASSERT_FALSE(world_.grasped().empty());
  }
  static MoveRequest above(const Eigen::Vector3d& place, double height_m) {
    MoveRequest request;
    request.world_from_tool = {place + Eigen::Vector3d(0, 0, height_m), Eigen::Quaterniond(0, 1, 0, 0)};
    return request;
  }
  World world_{library().get("stack_blocks")};
};

TEST_F(WithABlockInTheHand, ItGoesAlongAndMayTouchTheHand) { compare(world_, 400, 3); }

TEST_F(WithABlockInTheHand, ItStaysApartFromWhatStandsStillWhenAskedTo) {
  MoveRequest up = above(world_.world_from("block_1").position, 0.03);
  up.linear = up.ignore_collisions = true;
  ASSERT_TRUE(move_to(world_, up, {}));
  CollisionChecker checker(world_);
  ASSERT_TRUE(checker.carries());
  PlainChecker plain(world_);
  const JointLimits limits = Kinematics::from_model(world_.model(), world_.task().robot()).limits();
  const JointVector here = world_.frame().q;
  int apart = 0, near = 0;
  for (int i = 0; i < 2000; ++i) {
    JointVector q = random_posture(limits, 4, static_cast<std::uint64_t>(i));
    for (std::size_t k = 0; k < q.size(); ++k) q[k] = std::lerp(here[k], q[k], 0.05);
    const double distance = plain.carried_distance_m(q);
    const bool clear = plain.is_free(q, CollisionChecker::clear_depth_m);
    ASSERT_EQ(checker.carries_clear(q), clear && distance >= CollisionChecker::carried_clearance_m)
        << i << ": " << distance << " m";
    apart += clear && distance >= CollisionChecker::carried_clearance_m;
    near += clear && distance < CollisionChecker::carried_clearance_m;
  }
  EXPECT_GT(apart, 100);
  EXPECT_GT(near, 20);
}

TEST_F(WithABlockInTheHand, WhatTouchesWhereAMotionStartsMayGoOnTouchingButNoDeeper) {
  const Kinematics arm = Kinematics::from_model(world_.model(), world_.task().robot());
  const JointVector here = world_.frame().q;
  const auto lower = [&](double by_m) {  // the block goes into the table
    Pose tool = arm.world_from_tool(here);
    tool.position.z() -= by_m;
    return straight_tool_path(arm, here, tool).back();
  };
  CollisionChecker checker(world_);
  EXPECT_FALSE(checker.is_free(lower(0.004)));
  EXPECT_TRUE(checker.touches(lower(0.004)));
  checker.start_from(lower(0.004));
  EXPECT_TRUE(checker.is_free(lower(0.004)));
  EXPECT_TRUE(checker.touches(lower(0.004)));
  EXPECT_FALSE(checker.is_free(lower(0.008)));
  checker.start_from(here);
  EXPECT_FALSE(checker.is_free(lower(0.004)));
}

TEST_F(WithABlockInTheHand, APlannedWayCarriesItPastOthersWithRoom) {
  constexpr double side_m = 0.05;
  const double table_m = world_.world_from("block_1").position.z() - side_m / 2;
  const auto over = [&](const std::string& block) {  // 8 mm above another one's top
    MoveRequest request = above(world_.world_from(block).position, 0);
    request.world_from_tool.position.z() = table_m + 1.5 * side_m + 0.008;
    return request;
  };
  MoveRequest up = over("block_1");
  up.linear = up.ignore_collisions = true;
  ASSERT_TRUE(move_to(world_, up, {}));
  int moves = 0;
  for (int k = 2; k <= 8; ++k) {
    const std::string name = (k <= 4 ? "block_" : "distractor_") + std::to_string(k <= 4 ? k : k - 4);
    const PlannedMove move = plan_move(world_, over(name));
    if (move.result.failure == MotionFailure::unreachable) continue;
    ASSERT_TRUE(move.result) << name << ": " << move.result.message;
    PlainChecker plain(world_);
    JointVector from = world_.frame().q;
    double nearest = 1;
    for (const JointVector& to : move.targets) {
      for (int i = 1; i <= 5; ++i)
        nearest = std::min(nearest, plain.carried_distance_m(joints_between(from, to, i / 5.0)));
      from = to;
    }
    EXPECT_GT(nearest, CollisionChecker::carried_clearance_m - 0.0002) << name;
    ++moves;
  }
  EXPECT_GE(moves, 4);
}

}  // namespace
}  // namespace flowscope
