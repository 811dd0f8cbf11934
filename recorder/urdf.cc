#include "recorder/urdf.h"

#include <algorithm>
#include <array>

#include "recorder/urdf_meshes.h"

namespace flowscope {
namespace {

bool is_left_by_xacro(const std::string& value) {
  return value.find("${") != std::string::npos || value.find("$(") != std::string::npos;
}

/// Throws SceneError for the first thing that xacro should have resolved.
void check_xacro(const SceneSource& urdf, const XmlElement& element) {
  const auto fail = [&](const std::string& what) {
    throw SceneError(urdf.place(element.place) + ": " + what +
                     " is for xacro to resolve: run xacro first (xacro robot.urdf.xacro > robot.urdf) and "
                     "open what it writes");
  };
  if (element.tag.starts_with("xacro:")) fail("<" + element.tag + ">");
  for (const auto& [name, value] : element.attributes) {
    if (is_left_by_xacro(value)) fail(name + "=\"" + value + "\"");
  }
  for (const auto& child : element.children) {
    // What other programs read may hold anything.
    if (child.tag != "gazebo" && child.tag != "transmission" && child.tag != "ros2_control")
      check_xacro(urdf, child);
  }
}

/// MuJoCo 2.2.2 does not survive others.
void check_joints(const SceneSource& urdf) {
  static const std::array<std::string, 6> known{"revolute", "continuous", "prismatic",
                                                "fixed",    "floating",   "planar"};
  for (const auto& child : urdf.root.children) {
    if (child.tag != "joint" || std::ranges::find(known, child.get("type")) != known.end()) continue;
    const std::string type = child.get("type");
    throw SceneError(urdf.place(child.place) + ": joint '" + child.get("name") + "' " +
                     (type.empty() ? "has no type" : "is of the unknown type '" + type + "'") +
                     " (known: revolute, continuous, prismatic, fixed, floating, planar)");
  }
}

/// MuJoCo finds no centre of mass for a link that has nothing but several visual shapes. One that no joint
/// moves gets a mass that is of no account.
void add_masses(XmlElement& robot) {
  const auto is_moved = [&](const std::string& link) {
    return std::ranges::any_of(robot.children, [&](const XmlElement& joint) {
      return joint.tag == "joint" && joint.get("type") != "fixed" &&
             std::ranges::any_of(joint.children, [&](const XmlElement& child) {
               return child.tag == "child" && child.get("link") == link;
             });
    });
  };
  for (auto& link : robot.children) {
    const bool is_weighed = std::ranges::any_of(link.children, [](const XmlElement& child) {
      return child.tag == "inertial" || child.tag == "collision";
    });
    if (link.tag != "link" || is_weighed || is_moved(link.get("name"))) continue;
    if (std::ranges::count(link.children, "visual", &XmlElement::tag) < 2) continue;
    XmlElement& inertial = link.add({"inertial", {}, {}, link.place});
    inertial.add({"mass", {{"value", "1e-9"}}, {}, link.place});
    inertial.add(
        {"inertia",
         {{"ixx", "1e-12"}, {"iyy", "1e-12"}, {"izz", "1e-12"}, {"ixy", "0"}, {"ixz", "0"}, {"iyz", "0"}},
         {},
         link.place});
  }
}

void dress(XmlElement& element, const std::map<std::string, std::string>& skins) {
  const auto is_visual = [](const XmlElement& child) {
    return child.tag == "geom" && child.get("contype") == "0" && child.get("conaffinity") == "0";
  };
  const bool is_seen = std::ranges::any_of(element.children, is_visual);
  for (auto& child : element.children) {
    if (child.tag == "body") dress(child, skins);
    if (child.tag != "geom") continue;
    if (is_seen && !is_visual(child)) child.set("group", "3");
    const auto skin = skins.find(from_xml_value(child.get("mesh")));
    if (skin == skins.end()) continue;
    std::erase_if(child.attributes, [](const auto& attribute) { return attribute.first == "rgba"; });
    child.set("material", to_xml_value(skin->second));
  }
}

}  // namespace

OpenedUrdf opened_urdf(const SceneSource& urdf, const std::function<void(const std::string&)>& note) {
  check_xacro(urdf, urdf.root);
  check_joints(urdf);
  XmlElement robot = urdf.root;
  const auto own = std::ranges::find(robot.children, "mujoco", &XmlElement::tag);
  const bool is_own = own != robot.children.end();
  add_masses(robot);
  UrdfMeshes meshes(urdf, note);
  meshes.open(robot, is_own ? &*own : nullptr);
  if (!is_own) {
    robot.add({"mujoco", {}, {}})
        .add({"compiler", {{"discardvisual", "false"}, {"fusestatic", "false"}, {"strippath", "false"}}, {}});
  }
  OpenedUrdf opened = meshes.take();
  opened.text = to_placed_text(robot);
  return opened;
}

std::string dressed_urdf(const std::string& mjcf, const std::map<std::string, std::string>& skins) {
  XmlElement root = parse_xml(mjcf);
  for (auto& child : root.children) {
    if (child.tag == "worldbody") dress(child, skins);
  }
  if (skins.empty()) return to_text(root);
  XmlElement& assets = root.add({"asset", {}, {}});
  for (const auto& [mesh, picture] : skins) {
    const std::string name = to_xml_value(picture);
    assets.add({"texture", {{"name", name}, {"type", "2d"}, {"file", name}}, {}});
    assets.add(
        {"material", {{"name", name}, {"texture", name}, {"specular", "0.2"}, {"shininess", "0.3"}}, {}});
  }
  return to_text(root);
}

}  // namespace flowscope
