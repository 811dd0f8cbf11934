#include "recorder/scene_edit.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <functional>
#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace flowscope {
namespace {

namespace pt = boost::property_tree;
using Tree = pt::ptree;

/// An added motor's damping is its stiffness times `settle_s`.
struct Motor {
  double settle_s, armature;  ///< armature: kg m^2 or kg
};
constexpr Motor kArmMotor{0.06, 0.1}, kFingerMotor{0.02, 0.01};
const Eigen::Vector3d kWristCamera(0.06, 0, -0.12);  ///< metres, in the tool's frame, looking along +z

Tree parsed(const std::string& xml) {
  Tree tree;
  std::istringstream stream(xml);
  pt::read_xml(stream, tree, pt::xml_parser::trim_whitespace | pt::xml_parser::no_comments);
  return tree;
}

std::string written(const Tree& tree) {
  std::ostringstream stream;
  pt::write_xml(stream, tree);
  return stream.str();
}

std::string numbers(std::initializer_list<double> values) {
  std::ostringstream out;
  out.precision(15);
  for (const double value : values) out << (out.tellp() > 0 ? " " : "") << value;
  return out.str();
}
std::string numbers(const Eigen::Vector3d& v) { return numbers({v.x(), v.y(), v.z()}); }
std::string numbers(const Eigen::Vector4d& v) { return numbers({v[0], v[1], v[2], v[3]}); }

/// An element with attributes.
Tree element(std::initializer_list<std::pair<const char*, std::string>> attributes) {
  Tree tree;
  for (const auto& [name, value] : attributes) tree.put(std::string("<xmlattr>.") + name, value);
  return tree;
}

class Editor {
 public:
  Editor(const std::string& xml, const mjModel* scene, const mjModel* table, const RobotDescription& robot)
      : tree_(parsed(xml)), root_(tree_.get_child("mujoco")), scene_(scene), table_(table), robot_(robot) {}

  std::string run() {
    add_sky();
    add_lights();
    add_cameras();
    if (!robot_.joints.empty()) {
      add_sites();
      add_actuators();
      add_welds();
    }
    return written(tree_);
  }

 private:
  /// A further section: MJCF lets each come several times.
  Tree& section(const char* name) { return root_.add_child(name, Tree()); }

  /// `visit` gets every element below the world's body with its tag; parents first.
  void walk(const std::function<void(const std::string&, Tree&)>& visit) {
    const std::function<void(Tree&)> down = [&](Tree& node) {
      for (auto& [tag, child] : node) {
        visit(tag, child);
        if (tag == "body") down(child);
      }
    };
    for (auto& [tag, child] : root_) {
      if (tag == "worldbody") down(child);
    }
  }
  Tree& body(const std::string& name) {
    Tree* found = nullptr;
    walk([&](const std::string& tag, Tree& node) {
      if (tag == "body" && node.get("<xmlattr>.name", "") == name) found = &node;
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
    section("asset").add_child("texture", element({{"name", "flowscope_sky"},
                                                   {"type", "skybox"},
                                                   {"builtin", "gradient"},
                                                   {"rgb1", "0.86 0.88 0.90"},
                                                   {"rgb2", "0.62 0.65 0.69"},
                                                   {"width", "128"},
                                                   {"height", "768"}}));
  }

  /// A point about the table's centre, moved to where it lies about the scene's.
  Eigen::Vector3d moved(const mjtNum* point) const {
    const auto center = [](const mjModel* model) { return Eigen::Vector3d(model->stat.center); };
    const double scale = std::clamp(scene_->stat.extent / table_->stat.extent, 0.2, 10.0);
    return center(scene_) + scale * (Eigen::Vector3d(point) - center(table_));
  }

  void add_lights() {
    if (scene_->nlight > 0) return;
    Tree& world = section("worldbody");
    for (int i = 0; i < table_->nlight; ++i) {
      const auto color = [i](const float* values) {
        const float* rgb = values + 3 * i;
        return numbers({rgb[0], rgb[1], rgb[2]});
      };
      world.add_child("light", element({{"directional", table_->light_directional[i] ? "true" : "false"},
                                        {"castshadow", table_->light_castshadow[i] ? "true" : "false"},
                                        {"pos", numbers(moved(table_->light_pos + 3 * i))},
                                        {"dir", numbers(Eigen::Vector3d(table_->light_dir + 3 * i))},
                                        {"diffuse", color(table_->light_diffuse)},
                                        {"specular", color(table_->light_specular)}}));
    }
  }

  void add_cameras() {
    if (scene_->ncam > 0) return;
    Tree& world = section("worldbody");
    for (int i = 0; i < table_->ncam; ++i) {
      world.add_child("camera", element({{"name", mj_id2name(table_, mjOBJ_CAMERA, i)},
                                         {"fovy", numbers({table_->cam_fovy[i]})},
                                         {"pos", numbers(moved(table_->cam_pos + 3 * i))},
                                         {"quat", numbers(Eigen::Vector4d(table_->cam_quat + 4 * i))}}));
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
        .add_child("camera", element({{"name", "wrist"},
                                      {"fovy", "60"},
                                      {"pos", numbers(pose.position)},
                                      {"quat", numbers(pose.wxyz())}}));
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
    Tree site = element({{"name", name},
                         {"group", "4"},
                         {"pos", numbers(place.body_from_site.position)},
                         {"quat", numbers(place.body_from_site.wxyz())}});
    for (const auto& [key, value] : rest) site.put(std::string("<xmlattr>.") + key, value);
    body(place.body).add_child("site", site);
  }

  void add_actuators() {
    Tree actuators;
    for (std::size_t i = 0; i < robot_.stiffness.size(); ++i) {
      drive(robot_.joints[i], robot_.actuators[i], robot_.stiffness[i], kArmMotor, actuators);
    }
    for (const auto& finger : robot_.fingers) {
      if (finger.stiffness > 0) {
        drive(finger.joint, finger.actuator, finger.stiffness, kFingerMotor, actuators);
      }
    }
    if (actuators.empty()) return;
    section("actuator") = actuators;
    root_.erase("keyframe");  // its control inputs would be too few; the caller keeps its posture
  }
  /// A joint as stiff as a position-controlled motor.
  void drive(const std::string& joint, const std::string& actuator, double stiffness, const Motor& motor,
             Tree& actuators) {
    bool found = false;
    walk([&](const std::string& tag, Tree& node) {
      if (tag != "joint" || node.get("<xmlattr>.name", "") != joint) return;
      node.put("<xmlattr>.damping", numbers({motor.settle_s * stiffness}));
      node.put("<xmlattr>.armature", numbers({motor.armature}));
      found = true;
    });
    if (!found) throw std::runtime_error("the scene has no joint '" + joint + "'");
    actuators.add_child("general", element({{"name", actuator},
                                            {"joint", joint},
                                            {"gaintype", "fixed"},
                                            {"gainprm", numbers({stiffness})},
                                            {"biastype", "affine"},
                                            {"biasprm", numbers({0, -stiffness, 0})},
                                            {"ctrllimited", "false"},
                                            {"forcelimited", "false"}}));
  }

  void add_welds() {
    Tree welds;
    int unnamed = 0;
    walk([&](const std::string& tag, Tree& node) {
      if (tag != "body") return;
      const bool loose = std::any_of(node.begin(), node.end(), [](const auto& child) {
        return child.first == "freejoint" ||
               (child.first == "joint" &&
                child.second.template get<std::string>("<xmlattr>.type", "") == "free");
      });
      if (!loose || carries_hand(node)) return;
      std::string name = node.get("<xmlattr>.name", "");
      if (name.empty()) node.put("<xmlattr>.name", name = "object_" + std::to_string(++unnamed));
      welds.add_child("weld", element({{"body1", robot_.hand},
                                       {"body2", name},
                                       {"active", "false"},
                                       {"solref", "0.006 1"},
                                       {"solimp", "0.95 0.99 0.001"}}));
    });
    if (!welds.empty()) section("equality") = welds;
  }
  bool carries_hand(const Tree& node) const {
    if (node.get("<xmlattr>.name", "") == robot_.hand) return true;
    return std::any_of(node.begin(), node.end(), [this](const auto& child) {
      return child.first == "body" && carries_hand(child.second);
    });
  }

  Tree tree_;
  Tree& root_;
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

std::string opened_urdf(const std::string& urdf) {
  Tree tree = parsed(urdf);
  Tree& robot = tree.get_child("robot");
  if (!robot.get_child_optional("mujoco.compiler")) {
    robot.put_child("mujoco.compiler", element({{"discardvisual", "false"}, {"fusestatic", "false"}}));
  }
  return written(tree);
}

}  // namespace flowscope
