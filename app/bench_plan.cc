#include "app/bench_plan.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <numbers>
#include <optional>
#include <random>

#include "recorder/motion/collision.h"
#include "recorder/motion/motion.h"
#include "recorder/motion/planner.h"

namespace flowscope {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kRecheck_rad = 0.0025 / 4;
constexpr int kPairsPerScene = 10;

/// Of this thread: what planning takes on a machine that is busy with other things.
double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class Problems {
 public:
  Problems(const std::filesystem::path& assets, std::uint64_t seed) : library_(assets), random_(seed) {}

  /// A world whose arm stands at a random free posture, and a pose to go to.
  struct Problem {
    World& world;
    Pose goal;
  };
  Problem next() {
    if (made_++ % kPairsPerScene == 0) open_scene();
    const auto [from, start] = draw_free();
    (void)from;
    stand(start);
    return {*world_, draw_free().first};
  }

 private:
  void open_scene() {
    static const std::vector<std::string> names{"push_buttons",   "stack_blocks", "open_drawer",
                                                "meat_off_grill", "stack_cups",   "put_item_in_drawer",
                                                "close_jar",      "turn_tap"};
    const int scene = made_ / kPairsPerScene;
    world_ = std::make_unique<World>(library_.get(names[static_cast<std::size_t>(scene) % names.size()]));
    world_->reset(0, static_cast<std::uint64_t>(scene));
    arm_.emplace(Kinematics::from_model(world_->model(), world_->task().robot()));
    checker_ = std::make_unique<CollisionChecker>(*world_);
    home_ = world_->frame().q;
  }

  double uniform(double lower, double upper) {
    return lower + (upper - lower) * (double(random_() >> 11) * 0x1.0p-53);
  }

  /// Over the table, the hand within 60 degrees of straight down, any yaw.
  Pose draw() {
    const double pi = std::numbers::pi;
    const Eigen::Vector3d place(uniform(0, 0.5), uniform(-0.4, 0.4), uniform(0.78, 1.25));
    const Eigen::Quaterniond yaw(Eigen::AngleAxisd(uniform(-pi, pi), Eigen::Vector3d::UnitZ()));
    const double around = uniform(-pi, pi);
    const Eigen::Quaterniond lean(
        Eigen::AngleAxisd(uniform(0, pi / 3), Eigen::Vector3d(std::cos(around), std::sin(around), 0)));
    return {place, lean * yaw * Eigen::Quaterniond(0, 1, 0, 0)};
  }

  std::pair<Pose, JointVector> draw_free() {
    for (;;) {
      const Pose pose = draw();
      for (const auto& q : arm_->solve_all(pose, home_)) {
        if (checker_->is_free(q)) return {pose, q};
      }
    }
  }

  void stand(const JointVector& q) {
    SceneState state = world_->state();
    const ArmIndices arm = find_arm(world_->model(), world_->task().robot());
    for (std::size_t i = 0; i < arm.joints; ++i) state.qpos[static_cast<std::size_t>(arm.qpos[i])] = q[i];
    world_->restore(state);
  }

  TaskLibrary library_;
  std::mt19937_64 random_;
  int made_ = 0;
  std::unique_ptr<World> world_;
  std::optional<Kinematics> arm_;
  std::unique_ptr<CollisionChecker> checker_;
  JointVector home_{};
};

double at_share(std::vector<double> times, double share) {
  std::ranges::sort(times);
  return times[static_cast<std::size_t>(share * double(times.size() - 1))];
}

}  // namespace

std::vector<BenchResult> bench_plan(const std::filesystem::path& assets, int pairs) {
  Problems problems(assets, 1);
  std::vector<double> times, processor_times;
  int solved = 0, in_a_second = 0, touching = 0;
  long checks = 0;
  double checking_s = 0;
  for (int i = 0; i < pairs; ++i) {
    const auto [world, goal] = problems.next();
    MoveRequest request;
    request.world_from_tool = goal;
    request.seed = static_cast<std::uint64_t>(i);
    const auto begin = Clock::now();
    const double processor_begin = processor_s();
    const PlannedMove move = plan_move(world, request);
    times.push_back(seconds_since(begin));
    processor_times.push_back(processor_s() - processor_begin);
    if (!move.result) continue;
    ++solved;
    in_a_second += times.back() <= 1;
    CollisionChecker checker(world);
    JointPath path{world.frame().q};
    path.insert(path.end(), move.targets.begin(), move.targets.end());
    const double begin_check = processor_s();
    touching += !path_is_free(  // by the checker's plain millimetre
        path, [&](const JointVector& q) { return ++checks, checker.is_free(q); }, kRecheck_rad);
    checking_s += processor_s() - begin_check;
  }
  const double share = 100.0 / pairs;
  return {{"plan, pairs", double(pairs), "", {}, {}},
          {"plan, solved", share * solved, "%", {}, {}},
          {"plan, solved within 1 s", share * in_a_second, "%", {}, {}},
          {"plan, median", 1000 * at_share(times, 0.5), "ms", {}, {}},
          {"plan, median of processor time", 1000 * at_share(processor_times, 0.5), "ms", {}, {}},
          {"plan, 95 of 100 within", 1000 * at_share(times, 0.95), "ms", {}, {}},
          {"plan, longest", 1000 * at_share(times, 1), "ms", {}, {}},
          {"plan, paths that touch", double(touching), "", {}, {}},
          {"plan, collision checks", double(checks) / checking_s, "/s", {}, {}}};
}

}  // namespace flowscope
