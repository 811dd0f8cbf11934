#include "app/bench_ik.h"

#include <algorithm>
#include <chrono>

#include "recorder/motion/ik_recovery.h"
#include "recorder/task.h"

namespace flowscope {
namespace {

/// Median time of `call(i)`, microseconds.
template <typename Call>
double median_us(int count, const Call& call) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    const auto begin = Clock::now();
    call(i);
    times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }
  std::ranges::nth_element(times, times.begin() + count / 2);
  return times[static_cast<std::size_t>(count) / 2];
}

}  // namespace

std::vector<BenchResult> bench_ik(const std::filesystem::path& assets) {
  constexpr int postures = 100'000, timed = 20'000;
  constexpr std::uint64_t seed = 1;
  const auto task = TaskLibrary(assets).get("push_buttons");
  const Kinematics arm = Kinematics::from_model(task->model(), task->robot());
  const IkRecovery found = recover_postures(arm, postures, seed);

  std::vector<JointVector> q;
  std::vector<Pose> wanted;
  for (int i = 0; i < timed; ++i) {
    q.push_back(random_posture(arm.limits(), seed + 1, static_cast<std::uint64_t>(i)));
    wanted.push_back(arm.world_from_tool(q.back()));
  }
  std::size_t solutions = 0;  // added up, so that nothing is optimised away
  const double one = median_us(timed, [&](int i) { solutions += arm.solve(wanted[i], q[i][6]).size(); });
  const double all =
      median_us(timed, [&](int i) { solutions += arm.solve_all(wanted[i], q[(i + 1) % timed]).size(); });
  const double share = 100.0 / found.postures;
  return {{"ik, recovered", share * found.recovered, "%", {}, {}},
          {"ik, own posture at its q7", share * found.own, "%", {}, {}},
          {"ik, largest error", found.largest_m, "m", {}, {}},
          {"ik, largest error", found.largest_rad, "rad", {}, {}},
          {"ik, all branches at one q7", one, "us", {}, {}},
          {"ik, choice over q7", all, "us", {}, {}},
          {"ik, solutions each", double(solutions) / timed, "", {}, {}}};
}

}  // namespace flowscope
