#include "recorder/success.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "recorder/success_overlap.h"
#include "recorder/task_variations.h"

namespace flowscope {
namespace {

struct Moment {
  const mjModel* model;
  const mjData* data;
  const std::vector<std::string>& grasped;
};

/// A condition; groups hold others. `met()` is the answer of the last update.
class Term {
 public:
  virtual ~Term() = default;
  virtual bool update(const Moment& now) = 0;
  virtual void list(std::vector<SuccessTerm>& out) const = 0;
  virtual void paint(mjModel*) const {}
};
using Terms = std::vector<std::unique_ptr<Term>>;

class Leaf : public Term {
 public:
  explicit Leaf(std::string name) : shown_{std::move(name), false, ""} {}
  void list(std::vector<SuccessTerm>& out) const override { out.push_back(shown_); }

 protected:
  bool show(bool met, std::string value) {
    shown_.met = met;
    shown_.value = std::move(value);
    return met;
  }
  bool met() const { return shown_.met; }

 private:
  SuccessTerm shown_;
};

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", metres * 1000);
  return text;
}

class JointTerm : public Leaf {
 public:
  JointTerm(std::string name, const mjModel* model, const mjData* data, int joint, double beyond)
      : Leaf(std::move(name)),
        address_(model->jnt_qposadr[joint]),
        hinge_(model->jnt_type[joint] == mjJNT_HINGE),
        start_(data->qpos[address_]),
        beyond_(beyond) {}
  bool update(const Moment& now) override {
    const double moved = std::abs(now.data->qpos[address_] - start_);
    char degrees[32];
    std::snprintf(degrees, sizeof degrees, "%.1f deg", moved * 180 / std::numbers::pi);
    return show(moved > beyond_, hinge_ ? degrees : millimetres(moved));
  }

 private:
  int address_;
  bool hinge_;
  double start_, beyond_;  ///< m or rad
};

class PressedTerm : public JointTerm {
 public:
  PressedTerm(std::string name, const mjModel* model, const mjData* data, int joint, double travel,
              int material, std::array<float, 3> rgb)
      : JointTerm(std::move(name), model, data, joint, travel), material_(material), rgb_(rgb) {}
  void paint(mjModel* model) const override {
    if (met() && material_ >= 0) std::copy(rgb_.begin(), rgb_.end(), model->mat_rgba + 4 * material_);
  }

 private:
  int material_;
  std::array<float, 3> rgb_;
};

class InsideTerm : public Leaf {
 public:
  InsideTerm(std::string name, int body, int site) : Leaf(std::move(name)), body_(body), site_(site) {}
  bool update(const Moment& now) override {
    const SensorBox box = sensor_box(now.model, now.data, site_);
    const bool met = body_overlaps(now.model, now.data, body_, box);
    const Eigen::Map<const Eigen::Vector3d> center(now.data->xpos + 3 * body_);
    return show(met, met ? "inside"
                         : millimetres((center - box.world_from_box.position).norm()) + " from its centre");
  }

 private:
  int body_, site_;
};

/// A body or a site.
struct Frame3 {
  bool site = false;
  int id = 0;
  Eigen::Vector3d position(const mjData* data) const {
    return Eigen::Map<const Eigen::Vector3d>((site ? data->site_xpos : data->xpos) + 3 * id);
  }
};

class NearTerm : public Leaf {
 public:
  NearTerm(std::string name, Frame3 frame, Frame3 to, double within)
      : Leaf(std::move(name)), frame_(frame), to_(to), within_(within) {}
  bool update(const Moment& now) override {
    const double distance = (frame_.position(now.data) - to_.position(now.data)).norm();
    return show(distance <= within_, millimetres(distance));
  }

 private:
  Frame3 frame_, to_;
  double within_;  ///< metres
};

class GraspTerm : public Leaf {
 public:
  GraspTerm(std::string name, std::string body, bool wanted)
      : Leaf(std::move(name)), body_(std::move(body)), wanted_(wanted) {}
  bool update(const Moment& now) override {
    const bool held = body_ == "any"
                          ? !now.grasped.empty()
                          : std::find(now.grasped.begin(), now.grasped.end(), body_) != now.grasped.end();
    return show(held == wanted_, held ? "held" : "free");
  }

 private:
  std::string body_;
  bool wanted_;
};

enum class Rule { all, any, in_order };

class Group : public Term {
 public:
  Group(Rule rule, Terms terms) : rule_(rule), terms_(std::move(terms)) {}
  bool update(const Moment& now) override {
    if (rule_ == Rule::in_order) {
      while (latched_ < terms_.size() && terms_[latched_]->update(now)) ++latched_;
      return latched_ == terms_.size();
    }
    std::size_t met = 0;
    for (const auto& term : terms_) met += term->update(now);
    return rule_ == Rule::all ? met == terms_.size() : met > 0;
  }
  void list(std::vector<SuccessTerm>& out) const override {
    for (const auto& term : terms_) term->list(out);
  }
  void paint(mjModel* model) const override {
    for (const auto& term : terms_) term->paint(model);
  }

 private:
  Rule rule_;
  Terms terms_;
  std::size_t latched_ = 0;  ///< in_order: this many have been true, each after the one before
};

class Builder {
 public:
  Builder(const TaskReader& reader, const mjModel* model, const mjData* data)
      : reader_(reader), model_(model), data_(data) {}

  std::unique_ptr<Term> term(const TaskNode& node) const {
    if (!node.is_map() || node.keys.size() != 1) reader_.fail(node, "a success term is one 'word: …'");
    const std::string& word = node.keys[0];
    const TaskNode& value = node.items[0];
    if (word == "all") return group(Rule::all, value);
    if (word == "any") return group(Rule::any, value);
    if (word == "in_order") return group(Rule::in_order, value);
    if (word == "joint") return joint(value);
    if (word == "pressed") return pressed(value);
    if (word == "inside") return inside(value);
    if (word == "near") return near(value);
    if (word == "grasped" || word == "released") return grasp(word, value);
    reader_.fail(node, "no success term is called '" + word +
                           "' (known: joint, inside, pressed, grasped, released, near, all, any, in_order)");
  }

 private:
  int find(mjtObj type, const TaskNode& node, const char* what) const {
    const int id = mj_name2id(model_, type, reader_.text(node, what).c_str());
    if (id < 0) reader_.fail(node, std::string("the scene has no ") + what + " '" + node.text + "'");
    return id;
  }
  int slide_or_hinge(const TaskNode& value) const {
    const TaskNode& name = reader_.require(value, "joint");
    const int id = find(mjOBJ_JOINT, name, "joint");
    if (model_->jnt_type[id] != mjJNT_SLIDE && model_->jnt_type[id] != mjJNT_HINGE) {
      reader_.fail(name, "joint '" + name.text + "' is neither a slide nor a hinge");
    }
    return id;
  }
  double positive(const TaskNode& map, const std::string& key) const {
    const TaskNode& node = reader_.require(map, key);
    const double value = reader_.number(node, key);
    if (value <= 0) reader_.fail(node, "'" + key + "' must be above 0");
    return value;
  }

  std::unique_ptr<Term> group(Rule rule, const TaskNode& value) const {
    Terms terms;
    for (const auto& item : reader_.list(value, "success")) terms.push_back(term(item));
    if (terms.empty()) reader_.fail(value, "a group needs at least one term");
    return std::make_unique<Group>(rule, std::move(terms));
  }
  std::unique_ptr<Term> joint(const TaskNode& value) const {
    reader_.check_keys(value, "joint", {"joint", "beyond"});
    const int id = slide_or_hinge(value);
    return std::make_unique<JointTerm>("joint " + value.find("joint")->text, model_, data_, id,
                                       positive(value, "beyond"));
  }
  std::unique_ptr<Term> pressed(const TaskNode& value) const {
    reader_.check_keys(value, "pressed", {"joint", "travel", "material", "color"});
    const int id = slide_or_hinge(value);
    int material = -1;
    std::array<float, 3> rgb{};
    if (const auto* node = value.find("material")) {
      material = find(mjOBJ_MATERIAL, *node, "material");
      const TaskNode& color = reader_.require(value, "color");
      try {
        rgb = color_rgb(reader_.text(color, "color"));
      } catch (const std::invalid_argument& error) {
        reader_.fail(color, error.what());
      }
    }
    return std::make_unique<PressedTerm>("pressed " + value.find("joint")->text, model_, data_, id,
                                         positive(value, "travel"), material, rgb);
  }
  std::unique_ptr<Term> inside(const TaskNode& value) const {
    reader_.check_keys(value, "inside", {"body", "sensor"});
    const TaskNode& body = reader_.require(value, "body");
    const TaskNode& sensor = reader_.require(value, "sensor");
    const int body_id = find(mjOBJ_BODY, body, "body");
    const int site_id = find(mjOBJ_SITE, sensor, "site");
    if (model_->site_type[site_id] != mjGEOM_BOX)
      reader_.fail(sensor, "site '" + sensor.text + "' is no box");
    return std::make_unique<InsideTerm>(body.text + " inside " + sensor.text, body_id, site_id);
  }
  Frame3 frame(const TaskNode& node) const {
    const std::string& name = reader_.text(node, "frame");
    if (const int site = mj_name2id(model_, mjOBJ_SITE, name.c_str()); site >= 0) return {true, site};
    return {false, find(mjOBJ_BODY, node, "body")};
  }
  std::unique_ptr<Term> near(const TaskNode& value) const {
    reader_.check_keys(value, "near", {"frame", "to", "within"});
    const TaskNode &from = reader_.require(value, "frame"), &to = reader_.require(value, "to");
    return std::make_unique<NearTerm>(from.text + " near " + to.text, frame(from), frame(to),
                                      positive(value, "within"));
  }
  std::unique_ptr<Term> grasp(const std::string& word, const TaskNode& value) const {
    const std::string& body = reader_.text(value, word);
    if (body != "any") find(mjOBJ_BODY, value, "body");
    return std::make_unique<GraspTerm>(word + " " + body, body, word == "grasped");
  }

  const TaskReader& reader_;
  const mjModel* model_;
  const mjData* data_;
};

class TreeCheck : public SuccessCheck {
 public:
  explicit TreeCheck(std::unique_ptr<Term> root) : root_(std::move(root)) {}
  bool update(const mjModel* model, const mjData* data, const std::vector<std::string>& grasped) override {
    return root_->update({model, data, grasped});
  }
  std::vector<SuccessTerm> terms() const override {
    std::vector<SuccessTerm> result;
    root_->list(result);
    return result;
  }
  void paint(mjModel* model) const override { root_->paint(model); }

 private:
  std::unique_ptr<Term> root_;
};

}  // namespace

std::unique_ptr<SuccessCheck> make_success(const TaskReader& reader, const TaskNode& node,
                                           const mjModel* model, const mjData* data) {
  return std::make_unique<TreeCheck>(Builder(reader, model, data).term(node));
}

}  // namespace flowscope
