#include "policy/things.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "policy/point_grid.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

constexpr float link_m = 0.025f, gap_m = 0.03f, reach_m = 0.10f, largest_m = 0.7f, arm_m = 0.5f,
                about_m = 0.15f, stands_m = 0.03f, largest_turn_rad = 0.44f;
constexpr int attempts = 8, fewest_points = 5;

struct Extent {
  Vector3f low = Vector3f::Constant(1e9f), high = Vector3f::Constant(-1e9f);
  int points = 0;
  bool near_tool = false;

  Vector3f middle() const { return 0.5f * (low + high); }
  bool is_arm() const { return near_tool && (high - low).maxCoeff() > arm_m; }
  float radius() const { return 0.5f * (high - low).head<2>().norm(); }
};

std::vector<Extent> extents(const std::vector<Vector3f>& position, const std::vector<int>& thing,
                            const Vector3f& tool) {
  std::vector<Extent> out;
  for (std::size_t i = 0; i < position.size(); ++i) {
    if (thing[i] < 0) continue;
    if (static_cast<std::size_t>(thing[i]) >= out.size()) out.resize(static_cast<std::size_t>(thing[i]) + 1);
    Extent& e = out[static_cast<std::size_t>(thing[i])];
    e.low = e.low.cwiseMin(position[i]);
    e.high = e.high.cwiseMax(position[i]);
    ++e.points;
    e.near_tool = e.near_tool || (position[i] - tool).head<2>().norm() < reach_m;
  }
  return out;
}

}  // namespace

std::vector<int> find_things(const std::vector<Vector3f>& position, const std::vector<char>& skip) {
  std::vector<Vector3f> place;
  std::vector<std::size_t> source;
  for (std::size_t i = 0; i < position.size(); ++i) {
    if (skip[i]) continue;
    place.push_back(position[i]);
    source.push_back(i);
  }
  const PointGrid grid(place, link_m);
  // Slots of each range that no thing has yet: a found one is stepped over ever after.
  std::vector<int> next(place.size() + 1);
  std::iota(next.begin(), next.end(), 0);
  std::vector<int> slot_of(place.size()), thing(position.size(), -1), open;
  for (std::size_t slot = 0; slot < place.size(); ++slot)
    slot_of[static_cast<std::size_t>(grid.index()[slot])] = static_cast<int>(slot);
  const auto free_from = [&next](int slot) {
    while (next[static_cast<std::size_t>(slot)] != slot) {
      int& at = next[static_cast<std::size_t>(slot)];
      slot = at = next[static_cast<std::size_t>(at)];
    }
    return slot;
  };
  const auto put = [&](int slot, int id) {
    next[static_cast<std::size_t>(slot)] = slot + 1;
    thing[source[static_cast<std::size_t>(grid.index()[static_cast<std::size_t>(slot)])]] = id;
    open.push_back(slot);
  };
  for (std::size_t i = 0, count = 0; i < place.size(); ++i) {
    if (thing[source[i]] >= 0) continue;
    const int id = static_cast<int>(count++);
    put(slot_of[i], id);
    while (!open.empty()) {
      const Vector3f p = grid.position()[static_cast<std::size_t>(open.back())];
      open.pop_back();
      grid.near(p, link_m, [&](int first, int last) {
        for (int slot = free_from(first); slot < last; slot = free_from(slot + 1))
          if ((grid.position()[static_cast<std::size_t>(slot)] - p).squaredNorm() <= link_m * link_m)
            put(slot, id);
      });
    }
  }
  return thing;
}

std::vector<ThingMove> shuffle_things(const std::vector<Vector3f>& position, const std::vector<int>& thing,
                                      float plane_z, const Vector3f& tool, float range_m, Random& random) {
  std::vector<Extent> all = extents(position, thing, tool);
  std::vector<ThingMove> moves(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Extent& e = all[i];
    const Vector3f size = e.high - e.low;
    if (e.points < fewest_points || e.near_tool || e.low.z() > plane_z + stands_m ||
        size.maxCoeff() > largest_m)
      continue;
    for (int attempt = 0; attempt < attempts; ++attempt) {
      const Vector3f by(static_cast<float>(random.uniform(-range_m, range_m)),
                        static_cast<float>(random.uniform(-range_m, range_m)), 0);
      const bool free = std::ranges::all_of(all, [&](const Extent& o) {
        if (&o == &e || o.points < fewest_points || o.is_arm()) return true;
        const float apart = (o.middle() - e.middle() - by).head<2>().norm();
        return apart > o.radius() + e.radius() + gap_m || o.low.z() > e.high.z() + 0.1f;
      });
      if (!free) continue;
      moves[i] = {e.middle(), by, static_cast<float>(random.uniform(-largest_turn_rad, largest_turn_rad))};
      all[i].low += by;
      all[i].high += by;
      break;
    }
  }
  return moves;
}

int thing_at(const std::vector<Vector3f>& position, const std::vector<int>& thing, float plane_z,
             const Vector3f& place) {
  const std::vector<Extent> all = extents(position, thing, place);
  int best = -1;
  float nearest = about_m;
  for (std::size_t i = 0; i < position.size(); ++i) {
    if (thing[i] < 0 || all[static_cast<std::size_t>(thing[i])].low.z() > plane_z + stands_m) continue;
    const float d = (position[i] - place).head<2>().norm();
    if (d < nearest) {
      nearest = d;
      best = thing[i];
    }
  }
  return best;
}

}  // namespace flowscope
