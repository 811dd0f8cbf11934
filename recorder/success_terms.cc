#include "recorder/success_terms.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "recorder/success_overlap.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", metres * 1000);
  return text;
}

std::string degrees(double radians) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f deg", radians * 180 / std::numbers::pi);
  return text;
}

Vector3d vector_at(const mjtNum* values, int index) { return Eigen::Map<const Vector3d>(values + 3 * index); }

std::string name_of(const mjModel* model, int type, int id) {
  const char* name = mj_id2name(model, type, id);
  return name ? name : "";
}

/// What is as far from the axis as the middle of what it turns shows the turning best, metres.
constexpr double kLeastArc_m = 0.03;
constexpr int kArcPoints = 24;

}  // namespace

bool Term::judge(const Moment& now) {
  met_ = holds(now);
  if (met_ && !first_met_s_) first_met_s_ = now.data->time;
  return met_;
}

void Leaf::list(const Moment& now, const std::string& path, std::vector<SuccessTerm>& out) const {
  Reading reading = read(now);
  out.push_back({name_, met(), std::move(reading.text), path, std::move(reading.measure), first_met_s()});
}

void Leaf::detect(const Moment& now, std::vector<Detector>& out) const {
  auto found = detector(now);
  if (!found) return;
  found->name = name_;
  found->met = met();
  out.push_back(std::move(*found));
}

JointTerm::JointTerm(std::string name, const mjModel* model, const mjData* data, int joint, double beyond,
                     Paint paint)
    : Leaf(std::move(name)),
      joint_(joint),
      address_(model->jnt_qposadr[joint]),
      hinge_(model->jnt_type[joint] == mjJNT_HINGE),
      start_(data->qpos[address_]),
      beyond_(beyond),
      paint_(paint) {}

double JointTerm::moved(const Moment& now) const { return std::abs(now.data->qpos[address_] - start_); }

Reading JointTerm::read(const Moment& now) const {
  const double how_far = moved(now);
  if (hinge_) return {degrees(how_far), TermMeasure{how_far, beyond_, "rad", true}};
  return {millimetres(how_far), TermMeasure{how_far, beyond_, "m", true}};
}

/// The way of a point of the moved body, from where the joint was to where the term is met: towards the side
/// on which it is now, or that has room for it.
std::optional<Detector> JointTerm::detector(const Moment& now) const {
  const mjModel* m = now.model;
  const double offset = now.data->qpos[address_] - start_;
  double side = offset < 0 ? -1 : 1;
  const double room_above = m->jnt_range[2 * joint_ + 1] - start_;
  if (std::abs(offset) < 0.1 * beyond_ && m->jnt_limited[joint_] && room_above < beyond_) side = -1;
  const Vector3d anchor = vector_at(now.data->xanchor, joint_), axis = vector_at(now.data->xaxis, joint_);
  const Vector3d middle = vector_at(now.data->xipos, m->jnt_bodyid[joint_]);
  Detector detector;
  detector.place = name_of(m, mjOBJ_JOINT, joint_);
  detector.shape = Detector::Shape::track;
  detector.reached = std::clamp(std::abs(offset) / beyond_, 0.0, 1.0);
  if (!hinge_) {
    const Vector3d begin = middle - offset * axis;
    detector.track = {begin, begin + side * beyond_ * axis};
    return detector;
  }
  Vector3d arm = middle - anchor - axis * axis.dot(middle - anchor);
  if (arm.norm() < kLeastArc_m)
    arm = kLeastArc_m * (arm.norm() > 1e-6 ? arm.normalized() : axis.unitOrthogonal());
  const Vector3d center = anchor + axis * axis.dot(middle - anchor);
  for (int i = 0; i < kArcPoints; ++i) {
    const double angle = side * beyond_ * i / (kArcPoints - 1) - offset;
    detector.track.push_back(center + Eigen::AngleAxisd(angle, axis) * arm);
  }
  return detector;
}

void JointTerm::paint(mjModel* model) const {
  if (met() && paint_.material >= 0) {
    std::copy(paint_.rgb.begin(), paint_.rgb.end(), model->mat_rgba + 4 * paint_.material);
  }
}

bool InsideTerm::holds(const Moment& now) {
  return body_overlaps(now.model, now.data, body_, sensor_box(now.model, now.data, site_));
}

Reading InsideTerm::read(const Moment& now) const {
  const double gap = body_gap(now.model, now.data, body_, sensor_box(now.model, now.data, site_));
  return {millimetres(std::abs(gap)) + (gap > 0 ? " outside" : " deep"), TermMeasure{gap, 0, "m", false}};
}

std::optional<Detector> InsideTerm::detector(const Moment& now) const {
  const SensorBox box = sensor_box(now.model, now.data, site_);
  Detector detector;
  detector.place = name_of(now.model, mjOBJ_SITE, site_);
  detector.world_from_shape = box.world_from_box;
  detector.half_size = box.half_size;
  detector.subject = vector_at(now.data->xipos, body_);
  return detector;
}

Vector3d PlaceOf::position(const mjData* data) const {
  return vector_at(site ? data->site_xpos : data->xpos, id);
}

double NearTerm::distance(const Moment& now) const {
  return (frame_.position(now.data) - to_.position(now.data)).norm();
}

Reading NearTerm::read(const Moment& now) const {
  return {millimetres(distance(now)), TermMeasure{distance(now), within_m_, "m", false}};
}

std::optional<Detector> NearTerm::detector(const Moment& now) const {
  Detector detector;
  detector.place = name_of(now.model, to_.site ? mjOBJ_SITE : mjOBJ_BODY, to_.id);
  detector.shape = Detector::Shape::sphere;
  detector.world_from_shape.position = to_.position(now.data);
  detector.half_size.setConstant(within_m_);
  detector.subject = frame_.position(now.data);
  return detector;
}

bool GraspTerm::held(const Moment& now) const {
  return body_ == "any" ? !now.grasped->empty()
                        : std::ranges::find(*now.grasped, body_) != now.grasped->end();
}

Reading GraspTerm::read(const Moment& now) const {
  const bool it_is = held(now);
  return {it_is ? "held" : "free", TermMeasure{it_is ? 1.0 : 0.0, 0, "", wanted_}};
}

bool Group::holds(const Moment& now) {
  if (rule_ == Rule::in_order) {
    while (latched_ < terms_.size() && terms_[latched_]->judge(now)) ++latched_;
    return latched_ == terms_.size();
  }
  std::size_t met = 0;
  for (const auto& term : terms_) met += term->judge(now);
  return rule_ == Rule::all ? met == terms_.size() : met > 0;
}

void Group::list(const Moment& now, const std::string& path, std::vector<SuccessTerm>& out) const {
  const char* word = rule_ == Rule::all ? "all" : rule_ == Rule::any ? "any" : "in_order";
  for (std::size_t i = 0; i < terms_.size(); ++i)
    terms_[i]->list(now, path + (path.empty() ? "" : "/") + word + "/" + std::to_string(i), out);
}

void Group::detect(const Moment& now, std::vector<Detector>& out) const {
  for (const auto& term : terms_) term->detect(now, out);
}

void Group::paint(mjModel* model) const {
  for (const auto& term : terms_) term->paint(model);
}

}  // namespace flowscope
