#include "recorder/scene_edit.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "recorder/xml_tree.h"

namespace flowscope {
namespace {

/// An added motor's damping is its stiffness times `settle_s`.
struct Motor {
  double settle_s, armature;  ///< armature: kg m^2 or kg
};
constexpr Motor kArmMotor{0.06, 0.1}, kFingerMotor{0.02, 0.01};
const Eigen::Vector3d kWristCamera(0.06, 0, -0.12);  ///< metres, in the tool's frame, looking along +z

std::string numbers(std::initializer_list<double> values) {
  std::ostringstream out;
  out.precision(15);
  for (const double value : values) out << (out.tellp() > 0 ? " " : "") << value;
  return out.str();
}
std::string numbers(const Eigen::Vector3d& v) { return numbers({v.x(), v.y(), v.z()}); }
std::string numbers(const Eigen::Vector4d& v) { return numbers({v[0], v[1], v[2], v[3]}); }

class Editor {
 public:
  Editor(const std::string& xml, const mjModel* scene, const mjModel* table, const RobotDescription& robot)
      : root_(parse_xml(xml)), scene_(scene), table_(table), robot_(robot) {}

  std::string run() {
    add_sky();
    add_lights();
    add_cameras();
    if (!robot_.joints.empty()) {
      add_sites();
      add_actuators();
      add_welds();
      part_base();
    }
    return to_text(root_);
  }

 private:
  /// A further section: MJCF lets each come several times.
  XmlElement& section(const char* name) { return root_.add({name, {}, {}}); }

  /// `visit` gets every element below the world's body; parents first.
  void walk(const std::function<void(XmlElement&)>& visit) {
    const std::function<void(XmlElement&)> down = [&](XmlElement& node) {
      for (auto& child : node.children) {
        visit(child);
        if (child.tag == "body") down(child);
      }
    };
    for (auto& child : root_.children) {
      if (child.tag == "worldbody") down(child);
    }
  }
  XmlElement& body(const std::string& name) {
    XmlElement* found = nullptr;
    walk([&](XmlElement& node) {
      if (node.tag == "body" && node.get("name") == name) found = &node;
    });
    if (!found) throw std::runtime_error("the scene has no body '" + name + "' (known: " + bodies() + ")");
    return *found;
  }
  std::string bodies() const {
    std::string known;
    for (int i = 1; i < scene_->nbody; ++i) {
      const char* name = mj_id2name(scene_, mjOBJ_BODY, i);
      if (name && *name) known += (known.empty() ? "" : ", ") + std::string(name);
    }
    return known;
  }

  void add_sky() {
    for (int i = 0; i < scene_->ntex; ++i) {
      if (scene_->tex_type[i] == mjTEXTURE_SKYBOX) return;
    }
    section("asset").add({"texture",
                          {{"name", "flowscope_sky"},
                           {"type", "skybox"},
                           {"builtin", "gradient"},
                           {"rgb1", "0.86 0.88 0.90"},
                           {"rgb2", "0.62 0.65 0.69"},
                           {"width", "128"},
                           {"height", "768"}},
                          {}});
  }

  /// A point about the table's centre, moved to where it lies about the scene's.
  Eigen::Vector3d moved(const mjtNum* point) const {
    const auto center = [](const mjModel* model) { return Eigen::Vector3d(model->stat.center); };
    const double scale = std::clamp(scene_->stat.extent / table_->stat.extent, 0.2, 10.0);
    return center(scene_) + scale * (Eigen::Vector3d(point) - center(table_));
  }

  void add_lights() {
    if (scene_->nlight > 0) return;
    XmlElement& world = section("worldbody");
    for (int i = 0; i < table_->nlight; ++i) {
      const auto color = [i](const float* values) {
        const float* rgb = values + 3 * i;
        return numbers({rgb[0], rgb[1], rgb[2]});
      };
      world.add({"light",
                 {{"directional", table_->light_directional[i] ? "true" : "false"},
                  {"castshadow", table_->light_castshadow[i] ? "true" : "false"},
                  {"pos", numbers(moved(table_->light_pos + 3 * i))},
                  {"dir", numbers(Eigen::Vector3d(table_->light_dir + 3 * i))},
                  {"diffuse", color(table_->light_diffuse)},
                  {"specular", color(table_->light_specular)}},
                 {}});
    }
  }

  void add_cameras() {
    if (scene_->ncam > 0) return;
    XmlElement& world = section("worldbody");
    for (int i = 0; i < table_->ncam; ++i) {
      world.add({"camera",
                 {{"name", mj_id2name(table_, mjOBJ_CAMERA, i)},
                  {"fovy", numbers({table_->cam_fovy[i]})},
                  {"pos", numbers(moved(table_->cam_pos + 3 * i))},
                  {"quat", numbers(Eigen::Vector4d(table_->cam_quat + 4 * i))}},
                 {}});
    }
    wrist_camera_ = true;
  }

  void add_sites() {
    if (const auto& tool = robot_.tool_place) add_site("tool", *tool, {});
    if (const auto& attach = robot_.attach_place) {
      add_site("attach", *attach, {{"type", "box"}, {"size", numbers(Eigen::Vector3d(attach->size / 2))}});
    }
    if (!wrist_camera_ || robot_.joints.empty()) return;
    const auto place = tool_place();
    if (!place) return;
    // MuJoCo looks along -z with y up.
    const Pose tool_from_camera{kWristCamera, Eigen::Quaterniond(0, 1, 0, 0)};
    const Pose pose = place->body_from_site * tool_from_camera;
    body(place->body)
        .add({"camera",
              {{"name", "wrist"},
               {"fovy", "60"},
               {"pos", numbers(pose.position)},
               {"quat", numbers(pose.wxyz())}},
              {}});
  }
  std::optional<SiteDescription> tool_place() const {
    if (robot_.tool_place) return robot_.tool_place;
    const int site = mj_name2id(scene_, mjOBJ_SITE, robot_.tool.c_str());
    const char* name = site < 0 ? nullptr : mj_id2name(scene_, mjOBJ_BODY, scene_->site_bodyid[site]);
    if (!name) return std::nullopt;
    return SiteDescription{name,
                           Pose::from_wxyz(Eigen::Vector3d(scene_->site_pos + 3 * site),
                                           Eigen::Vector4d(scene_->site_quat + 4 * site)),
                           Eigen::Vector3d::Zero()};
  }
  void add_site(const char* name, const SiteDescription& place,
                std::initializer_list<std::pair<const char*, std::string>> rest) {
    XmlElement site{"site",
                    {{"name", name},
                     {"group", "4"},
                     {"pos", numbers(place.body_from_site.position)},
                     {"quat", numbers(place.body_from_site.wxyz())}},
                    {}};
    for (const auto& [key, value] : rest) site.set(key, value);
    body(place.body).add(std::move(site));
  }

  void add_actuators() {
    std::vector<XmlElement> actuators;
    for (std::size_t i = 0; i < robot_.stiffness.size(); ++i) {
      drive(robot_.joints[i], robot_.actuators[i], robot_.stiffness[i], kArmMotor, actuators);
    }
    for (const auto& finger : robot_.fingers) {
      if (finger.stiffness > 0) {
        drive(finger.joint, finger.actuator, finger.stiffness, kFingerMotor, actuators);
      }
    }
    if (actuators.empty()) return;
    // Behind the others, whose numbers stay; but those with activations must come last.
    root_.children.insert(scene_->na > 0 ? root_.children.begin() : root_.children.end(),
                          {"actuator", {}, std::move(actuators)});
    std::erase_if(root_.children, [](const XmlElement& child) {
      return child.tag == "keyframe";
    });  // its control inputs would be too few; the caller keeps them
  }
  /// A joint as stiff as a position-controlled motor.
  void drive(const std::string& joint, const std::string& actuator, double stiffness, const Motor& motor,
             std::vector<XmlElement>& actuators) {
    bool found = false;
    walk([&](XmlElement& node) {
      if (node.tag != "joint" || node.get("name") != joint) return;
      node.set("damping", numbers({motor.settle_s * stiffness}));
      node.set("armature", numbers({motor.armature}));
      found = true;
    });
    if (!found) throw std::runtime_error("the scene has no joint '" + joint + "'");
    switch_off_others(joint);
    actuators.push_back({"general",
                         {{"name", actuator},
                          {"joint", joint},
                          {"gear", "1 0 0 0 0 0"},
                          {"dyntype", "none"},
                          {"gaintype", "fixed"},
                          {"gainprm", numbers({stiffness})},
                          {"biastype", "affine"},
                          {"biasprm", numbers({0, -stiffness, 0})},
                          {"ctrllimited", "false"},
                          {"forcelimited", "false"}},
                         {}});
  }

  /// Actuators that the scene has for a joint stay, so that its sensors find them, but do nothing.
  void switch_off_others(const std::string& joint) {
    for (auto& part : root_.children) {
      if (part.tag != "actuator") continue;
      for (auto& actuator : part.children) {
        if (actuator.get("joint") != joint && actuator.get("jointinparent") != joint) continue;
        actuator.set("gaintype", "fixed");
        actuator.set("gainprm", "0");
        actuator.set("biastype", "none");
      }
    }
  }

  void add_welds() {
    std::vector<XmlElement> welds;
    int unnamed = 0;
    walk([&](XmlElement& node) {
      if (node.tag != "body") return;
      const bool loose = std::any_of(node.children.begin(), node.children.end(), [](const auto& child) {
        return child.tag == "freejoint" || (child.tag == "joint" && child.get("type") == "free");
      });
      if (!loose || carries_hand(node)) return;
      std::string name = node.get("name");
      if (name.empty()) node.set("name", name = "object_" + std::to_string(++unnamed));
      welds.push_back({"weld",
                       {{"body1", robot_.hand},
                        {"body2", name},
                        {"active", "false"},
                        {"solref", "0.006 1"},
                        {"solimp", "0.95 0.99 0.001"}},
                       {}});
    });
    if (!welds.empty()) section("equality").children = std::move(welds);
  }
  bool carries_hand(const XmlElement& node) const {
    if (node.get("name") == robot_.hand) return true;
    return std::any_of(node.children.begin(), node.children.end(),
                       [this](const auto& child) { return child.tag == "body" && carries_hand(child); });
  }

  /// The engine lets neighbours overlap at their joint, but not where one of them is fixed to the world:
  /// there an arm and its base would push each other for ever.
  void part_base() {
    const int joint = mj_name2id(scene_, mjOBJ_JOINT, robot_.joints.front().c_str());
    if (joint < 0) return;
    const int link = scene_->jnt_bodyid[joint], base = scene_->body_parentid[link];
    const int signature = ((std::min(base, link) + 1) << 16) + std::max(base, link) + 1;
    const int *known = scene_->exclude_signature, *end = known + scene_->nexclude;
    if (base == 0 || std::find(known, end, signature) != end) return;
    const char *link_name = mj_id2name(scene_, mjOBJ_BODY, link),
               *base_name = mj_id2name(scene_, mjOBJ_BODY, base);
    if (!link_name || !base_name || !*link_name || !*base_name) return;
    section("contact").add({"exclude", {{"body1", base_name}, {"body2", link_name}}, {}});
  }

  XmlElement root_;
  const mjModel* scene_;
  const mjModel* table_;
  const RobotDescription& robot_;
  bool wrist_camera_ = false;
};

}  // namespace

std::string completed_scene(const std::string& xml, const mjModel* scene, const mjModel* table,
                            const RobotDescription& robot) {
  return Editor(xml, scene, table, robot).run();
}

}  // namespace flowscope
