#include "recorder/motion/rounded_path.h"

#include <algorithm>
#include <cmath>

namespace flowscope {
namespace {

using Joints = RoundedPath::Joints;

constexpr double kSame_rad = 1e-9;         ///< corners this near are one
constexpr double kStraight_rad = 1e-6;     ///< a turn of the path that is none
constexpr double kSmallestRadius = 1e-4;   ///< rad: below, the corner is a stop
constexpr double kLongestInterval = 0.01;  ///< rad
constexpr double kLargestTurn_rad = 0.1;   ///< of an arc within an interval

Joints joints_of(const JointVector& q) { return Eigen::Map<const Joints>(q.data()); }

/// Largest magnitude between two angles of a sinusoid whose derivative has signs `d0` and `d1` there.
double largest(double f0, double f1, double d0, double d1, double amplitude) {
  return d0 * d1 < 0 ? amplitude : std::max(std::abs(f0), std::abs(f1));
}

}  // namespace

RoundedPath::RoundedPath(const JointPath& corners, double deviation_rad) {
  std::vector<Joints> points;
  for (const auto& corner : corners) {
    const Joints q = joints_of(corner);
    if (points.empty() || (q - points.back()).norm() > kSame_rad) points.push_back(q);
  }
  if (points.size() < 2) return;
  Joints from = points.front();
  bool stop = false;
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const Joints in = points[i] - points[i - 1], out = points[i + 1] - points[i];
    const Joints u = in.normalized(), w = out.normalized();
    const double turn = 2 * std::atan2((w - u).norm(), (w + u).norm());
    if (turn < kStraight_rad) continue;
    const double sharp = 1 / std::cos(turn / 2) - 1;
    const double radius =
        std::min(deviation_rad / sharp, 0.5 * std::min(in.norm(), out.norm()) / std::tan(turn / 2));
    if (!(radius > kSmallestRadius)) {
      add_line(from, points[i], stop);
      from = points[i];
      stop = true;
      continue;
    }
    const double tangent = radius * std::tan(turn / 2);
    add_line(from, points[i] - tangent * u, stop);
    stop = false;
    Piece arc;
    arc.begin = length_;
    arc.radius = radius;
    arc.length = radius * turn;
    arc.origin = points[i] + radius / std::cos(turn / 2) * (w - u).normalized();
    arc.x = (points[i] - tangent * u - arc.origin) / radius;
    arc.y = u;
    pieces_.push_back(arc);
    length_ += arc.length;
    from = points[i] + tangent * w;
  }
  add_line(from, points.back(), stop);
}

void RoundedPath::add_line(const Joints& from, const Joints& to, bool stop_before) {
  Piece line;
  line.begin = length_;
  line.length = (to - from).norm();
  line.stop_before = stop_before;
  if (line.length < kSame_rad) return;  // two arcs meet
  line.origin = from;
  line.x = (to - from) / line.length;
  line.y.setZero();
  pieces_.push_back(line);
  length_ += line.length;
}

std::vector<RoundedPath::Interval> RoundedPath::intervals() const {
  std::vector<Interval> result;
  for (const Piece& piece : pieces_) {
    const double turn = piece.radius > 0 ? piece.length / piece.radius : 0;
    const int least = piece.radius > 0 ? 1 : 2;  // from rest to rest there is a place in between
    const int count = std::max(
        least,
        static_cast<int>(std::ceil(std::max(piece.length / kLongestInterval, turn / kLargestTurn_rad))));
    for (int i = 0; i < count; ++i) {
      Interval interval;
      interval.length = piece.length / count;
      interval.begin = piece.begin + i * interval.length;
      interval.stop_before = i == 0 && piece.stop_before;
      interval.slope = piece.x.cwiseAbs();
      interval.bend.setZero();
      if (piece.radius > 0) {
        const double a = turn * i / count, b = turn * (i + 1) / count;
        const Joints slope_a = std::cos(a) * piece.y - std::sin(a) * piece.x;
        const Joints slope_b = std::cos(b) * piece.y - std::sin(b) * piece.x;
        const Joints bend_a = std::cos(a) * piece.x + std::sin(a) * piece.y;
        const Joints bend_b = std::cos(b) * piece.x + std::sin(b) * piece.y;
        for (int k = 0; k < joints; ++k) {
          const double amplitude = std::hypot(piece.x[k], piece.y[k]);
          interval.slope[k] = largest(slope_a[k], slope_b[k], bend_a[k], bend_b[k], amplitude);
          interval.bend[k] = largest(bend_a[k], bend_b[k], slope_a[k], slope_b[k], amplitude) / piece.radius;
        }
      }
      result.push_back(interval);
    }
  }
  return result;
}

JointVector RoundedPath::at(double arc_length) const {
  auto piece = std::ranges::upper_bound(pieces_, arc_length, {}, &Piece::begin);
  if (piece != pieces_.begin()) --piece;
  const double s = std::clamp(arc_length - piece->begin, 0.0, piece->length);
  Joints q;
  if (piece->radius > 0) {
    const double angle = s / piece->radius;
    q = piece->origin + piece->radius * (std::cos(angle) * piece->x + std::sin(angle) * piece->y);
  } else {
    q = piece->origin + s * piece->x;
  }
  JointVector result;
  Eigen::Map<Joints>(result.data()) = q;
  return result;
}

}  // namespace flowscope
