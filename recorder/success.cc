#include "recorder/success.h"

#include <mujoco/mujoco.h>

#include "recorder/success_terms.h"
#include "recorder/task_variations.h"

namespace flowscope {
namespace {

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
                                       positive(value, "beyond"), JointTerm::Paint{});
  }
  std::unique_ptr<Term> pressed(const TaskNode& value) const {
    reader_.check_keys(value, "pressed", {"joint", "travel", "material", "color"});
    const int id = slide_or_hinge(value);
    JointTerm::Paint paint;
    if (const auto* node = value.find("material")) {
      paint.material = find(mjOBJ_MATERIAL, *node, "material");
      const TaskNode& color = reader_.require(value, "color");
      try {
        paint.rgb = color_rgb(reader_.text(color, "color"));
      } catch (const std::invalid_argument& error) {
        reader_.fail(color, error.what());
      }
    }
    return std::make_unique<JointTerm>("pressed " + value.find("joint")->text, model_, data_, id,
                                       positive(value, "travel"), paint);
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
  PlaceOf frame(const TaskNode& node) const {
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
  TreeCheck(std::unique_ptr<Term> root, const mjModel* model, const mjData* data)
      : root_(std::move(root)), model_(model), data_(data) {}
  bool update(const mjModel* model, const mjData* data, const std::vector<std::string>& grasped) override {
    model_ = model;
    data_ = data;
    grasped_ = grasped;
    return root_->judge(now());
  }
  std::vector<SuccessTerm> terms() const override {
    std::vector<SuccessTerm> result;
    root_->list(now(), "", result);
    return result;
  }
  std::vector<Detector> detectors() const override {
    std::vector<Detector> result;
    root_->detect(now(), result);
    return result;
  }
  void paint(mjModel* model) const override { root_->paint(model); }

 private:
  Moment now() const { return {model_, data_, &grasped_}; }

  std::unique_ptr<Term> root_;
  const mjModel* model_;
  const mjData* data_;
  std::vector<std::string> grasped_;
};

}  // namespace

std::unique_ptr<SuccessCheck> make_success(const TaskReader& reader, const TaskNode& node,
                                           const mjModel* model, const mjData* data) {
  return std::make_unique<TreeCheck>(Builder(reader, model, data).term(node), model, data);
}

}  // namespace flowscope
