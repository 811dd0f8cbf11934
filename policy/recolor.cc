#include "policy/recolor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "policy/point_grid.h"
#include "recorder/colors.h"

namespace flowscope {
namespace {

using Eigen::Vector3f;

constexpr float link_m = 0.025f, same_color = 0.15f, named_color = 0.45f, least_chroma = 0.2f;
constexpr int fewest_points = 5;

float chroma(const Vector3f& rgb) { return (rgb.array() - rgb.mean()).matrix().norm(); }

/// A colour as it is compared with others: read once, compared often.
struct Tone {
  Vector3f hue;
  float brightness;
  explicit Tone(const Vector3f& rgb)
      : hue((rgb.array() - rgb.mean()).matrix() / (chroma(rgb) + 0.1f)), brightness(rgb.mean()) {}
};

// Hue counts fully, brightness, which shading changes, little.
float difference(const Tone& a, const Tone& b) {
  const float brighter = a.brightness - b.brightness;
  return (a.hue - b.hue).squaredNorm() + brighter * brighter;
}

struct Part {
  Vector3f color = Vector3f::Zero();  ///< mean
  Tone tone{color};
  int points = 0;
  bool painted = false;
  Vector3f fresh = Vector3f::Zero();  ///< new colour in full light
  float light = 1;                    ///< brightness of `fresh` as it is seen here

  Vector3f repainted(const Vector3f& rgb) const {
    const float shade = std::clamp(rgb.mean() / std::max(color.mean(), 0.02f), 0.3f, 2.f);
    return (fresh * light * shade).cwiseMin(1.f);
  }
};

std::vector<Part> parts_of(const PreparedScene& scene) {
  std::vector<Part> parts;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (scene.part[i] < 0) continue;
    const auto id = static_cast<std::size_t>(scene.part[i]);
    if (id >= parts.size()) parts.resize(id + 1);
    parts[id].color += scene.points[i].color;
    ++parts[id].points;
  }
  for (Part& p : parts) {
    p.color /= static_cast<float>(std::max(p.points, 1));
    p.tone = Tone(p.color);
  }
  return parts;
}

// Named colours in a random order.
std::vector<Vector3f> shuffled_colors(Random& random) {
  std::vector<Vector3f> out;
  for (const NamedColor& c : benchmark_colors)
    if (const Vector3f rgb(c.rgb[0], c.rgb[1], c.rgb[2]); chroma(rgb) > least_chroma) out.push_back(rgb);
  for (std::size_t i = out.size(); i > 1; --i)
    std::swap(out[i - 1], out[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  return out;
}

void paint(Part& part, const Vector3f& fresh, const Vector3f& named) {
  part.painted = true;
  part.fresh = fresh;
  part.light = std::clamp(part.color.maxCoeff() / std::max(named.maxCoeff(), 0.1f), 0.3f, 1.f);
}

// Pixels know no part: that of the like-coloured one, if there is any.
void repaint(Patch& patch, const std::vector<Part>& parts) {
  for (std::size_t k = 0; k < patch.size(); k += 3) {
    Eigen::Map<Vector3f> rgb(&patch[k]);
    if (chroma(rgb) < least_chroma / 2) continue;
    const Tone seen(rgb);
    const auto nearest =
        std::ranges::min_element(parts, {}, [&](const Part& p) { return difference(p.tone, seen); });
    if (nearest->painted && difference(nearest->tone, seen) < 2 * same_color) rgb = nearest->repainted(rgb);
  }
}

}  // namespace

void turn_colors(PreparedScene& scene, std::vector<Word>& words, Random& random) {
  const auto angle = static_cast<float>(random.uniform(-std::numbers::pi, std::numbers::pi));
  Eigen::Matrix3f map = Eigen::AngleAxisf(angle, Vector3f::Ones().normalized()).toRotationMatrix();
  if (random.uniform() < 0.5) map.row(0).swap(map.row(1));
  for (ScenePoint& p : scene.points) p.color = map * p.color;
  for (Patch& patch : scene.patches)
    for (std::size_t k = 0; k < patch.size(); k += 3) {
      Eigen::Map<Vector3f> rgb(&patch[k]);
      rgb = (map * rgb).eval();
    }
  for (Word& w : words)
    if (w.row == Vocabulary::color) w.color = map * w.color;
}

std::vector<int> find_parts(const std::vector<Vector3f>& position, const std::vector<Vector3f>& color,
                            const std::vector<char>& skip) {
  const PointGrid grid(position, link_m);
  const std::vector<Tone> tone(color.begin(), color.end());
  std::vector<int> part(position.size(), -1);
  std::vector<int> members;
  int count = 0;
  std::vector<char> seen(skip);
  for (std::size_t seed = 0; seed < position.size(); ++seed) {
    if (seen[seed]) continue;
    members = {static_cast<int>(seed)};
    seen[seed] = 1;
    for (std::size_t at = 0; at < members.size(); ++at) {
      const Vector3f p = position[static_cast<std::size_t>(members[at])];
      grid.near(p, link_m, [&](int first, int last) {
        for (int slot = first; slot < last; ++slot) {
          const auto i = static_cast<std::size_t>(grid.index()[static_cast<std::size_t>(slot)]);
          if (seen[i] || (position[i] - p).squaredNorm() > link_m * link_m ||
              difference(tone[i], tone[seed]) > same_color)
            continue;
          seen[i] = 1;
          members.push_back(static_cast<int>(i));
        }
      });
    }
    if (static_cast<int>(members.size()) < fewest_points) continue;
    for (const int i : members) part[static_cast<std::size_t>(i)] = count;
    ++count;
  }
  return part;
}

bool repaint_parts(PreparedScene& scene, std::vector<Word>& words, Random& random) {
  std::vector<Part> parts = parts_of(scene);
  if (parts.empty()) return false;
  std::vector<Vector3f> fresh = shuffled_colors(random);
  std::vector<Word> renamed = words;
  for (Word& w : renamed) {
    if (w.row != Vocabulary::color) continue;
    if (chroma(w.color) < least_chroma) return false;
    const Tone named(w.color);
    const auto far = [&](const Part& p) { return difference(p.tone, named); };
    const float nearest = far(*std::ranges::min_element(parts, {}, far));
    if (nearest > named_color) return false;
    const auto twin = std::ranges::find_if(
        words, [&](const Word& o) { return o.row == Vocabulary::color && o.color == w.color; });
    const auto place = static_cast<std::size_t>(twin - words.begin());
    if (&renamed[place] != &w) {  // named before
      w.color = renamed[place].color;
      continue;
    }
    for (Part& p : parts)
      if (!p.painted && far(p) < nearest + 0.02f) paint(p, fresh.back(), w.color);
    w.color = fresh.back();
    fresh.pop_back();
  }
  std::size_t next = 0;
  for (Part& p : parts)
    if (!p.painted && chroma(p.color) > least_chroma)
      paint(p, fresh[next++ % fresh.size()], Vector3f::Ones());
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    if (scene.part[i] >= 0 && parts[static_cast<std::size_t>(scene.part[i])].painted)
      scene.points[i].color = parts[static_cast<std::size_t>(scene.part[i])].repainted(scene.points[i].color);
  for (Patch& patch : scene.patches) repaint(patch, parts);
  words = std::move(renamed);
  return true;
}

}  // namespace flowscope
