// The conditions that success.cc builds from a task's tree. Internal to the success vocabulary.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "recorder/success_term.h"

struct mjModel_;
struct mjData_;

namespace flowscope {

struct Moment {
  const mjModel_* model = nullptr;
  const mjData_* data = nullptr;
  const std::vector<std::string>* grasped = nullptr;  ///< bodies welded to the gripper
};

/// A condition; groups hold others.
class Term {
 public:
  virtual ~Term() = default;
  /// Once per physics step. A term inside in_order is only asked when its turn has come.
  bool judge(const Moment& now);
  /// What can be seen of it now; `path` is its place in the tree.
  virtual void list(const Moment& now, const std::string& path, std::vector<SuccessTerm>& out) const = 0;
  virtual void detect(const Moment& now, std::vector<Detector>& out) const = 0;
  virtual void paint(mjModel_* /*model*/) const {}

 protected:
  bool met() const { return met_; }
  const std::optional<double>& first_met_s() const { return first_met_s_; }

 private:
  virtual bool holds(const Moment& now) = 0;
  bool met_ = false;  ///< the last answer
  std::optional<double> first_met_s_;
};
using Terms = std::vector<std::unique_ptr<Term>>;

/// What a leaf measures: words for people and, where there is one, the number.
struct Reading {
  std::string text;
  std::optional<TermMeasure> measure = {};
};

class Leaf : public Term {
 public:
  explicit Leaf(std::string name) : name_(std::move(name)) {}
  void list(const Moment& now, const std::string& path, std::vector<SuccessTerm>& out) const override;
  void detect(const Moment& now, std::vector<Detector>& out) const override;

 private:
  virtual Reading read(const Moment& now) const = 0;  ///< only when somebody looks
  /// The shape it watches; none for what has no place.
  virtual std::optional<Detector> detector(const Moment& /*now*/) const { return std::nullopt; }
  std::string name_;
};

/// Moved more than `beyond` (m or rad) since the episode began. With a material: it is painted once that is
/// so.
class JointTerm : public Leaf {
 public:
  struct Paint {
    int material = -1;
    std::array<float, 3> rgb{};
  };
  JointTerm(std::string name, const mjModel_* model, const mjData_* data, int joint, double beyond,
            Paint paint);
  void paint(mjModel_* model) const override;

 private:
  bool holds(const Moment& now) override { return moved(now) > beyond_; }
  Reading read(const Moment& now) const override;
  std::optional<Detector> detector(const Moment& now) const override;
  double moved(const Moment& now) const;

  int joint_, address_;
  bool hinge_;
  double start_, beyond_;
  Paint paint_;
};

/// Any part of a body lies in the box of a site.
class InsideTerm : public Leaf {
 public:
  InsideTerm(std::string name, int body, int site) : Leaf(std::move(name)), body_(body), site_(site) {}

 private:
  bool holds(const Moment& now) override;
  Reading read(const Moment& now) const override;
  std::optional<Detector> detector(const Moment& now) const override;
  int body_, site_;
};

/// A body or a site.
struct PlaceOf {
  bool site = false;
  int id = 0;
  Eigen::Vector3d position(const mjData_* data) const;
};

class NearTerm : public Leaf {
 public:
  NearTerm(std::string name, PlaceOf frame, PlaceOf to, double within_m)
      : Leaf(std::move(name)), frame_(frame), to_(to), within_m_(within_m) {}

 private:
  bool holds(const Moment& now) override { return distance(now) <= within_m_; }
  Reading read(const Moment& now) const override;
  std::optional<Detector> detector(const Moment& now) const override;
  double distance(const Moment& now) const;
  PlaceOf frame_, to_;
  double within_m_;
};

/// Welded to the gripper, or not; `any` stands for every body.
class GraspTerm : public Leaf {
 public:
  GraspTerm(std::string name, std::string body, bool wanted)
      : Leaf(std::move(name)), body_(std::move(body)), wanted_(wanted) {}

 private:
  bool holds(const Moment& now) override { return held(now) == wanted_; }
  Reading read(const Moment& now) const override;
  bool held(const Moment& now) const;
  std::string body_;
  bool wanted_;
};

enum class Rule { all, any, in_order };

class Group : public Term {
 public:
  Group(Rule rule, Terms terms) : rule_(rule), terms_(std::move(terms)) {}
  void list(const Moment& now, const std::string& path, std::vector<SuccessTerm>& out) const override;
  void detect(const Moment& now, std::vector<Detector>& out) const override;
  void paint(mjModel_* model) const override;

 private:
  bool holds(const Moment& now) override;
  Rule rule_;
  Terms terms_;
  std::size_t latched_ = 0;  ///< in_order: this many have been true, each after the one before
};

}  // namespace flowscope
