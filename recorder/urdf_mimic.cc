#include "recorder/urdf_mimic.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "recorder/xml_tree.h"

namespace flowscope {
namespace {

class MimicReader {
 public:
  explicit MimicReader(const SceneSource& urdf) : urdf_(urdf) {}

  std::vector<JointCoupling> read() {
    const XmlElement& robot = urdf_.root;
    for (const auto& joint : robot.children) {
      if (joint.tag != "joint") continue;
      for (const auto& child : joint.children) {
        if (child.tag == "mimic" && joint.get("type") != "fixed")
          couplings_.push_back(coupling(joint, child));
      }
    }
    for (const auto& coupling : couplings_) check(coupling, robot);
    return std::move(couplings_);
  }

 private:
  [[noreturn]] void fail(const std::string& joint, const std::string& message) const {
    throw SceneError(urdf_.place(place_of(joint)) + ": joint '" + joint + "' " + message);
  }
  XmlPlace place_of(const std::string& name) const {
    for (const auto& joint : urdf_.root.children) {
      if (joint.tag != "joint" || joint.get("name") != name) continue;
      const auto mimic = std::ranges::find(joint.children, "mimic", &XmlElement::tag);
      return mimic == joint.children.end() ? joint.place : mimic->place;
    }
    return urdf_.root.place;
  }

  JointCoupling coupling(const XmlElement& joint, const XmlElement& mimic) const {
    JointCoupling result;
    result.follower = joint.get("name");
    result.leader = mimic.get("joint");
    result.multiplier = number(result.follower, mimic, "multiplier", 1);
    result.offset = number(result.follower, mimic, "offset", 0);
    return result;
  }
  double number(const std::string& joint, const XmlElement& mimic, const std::string& key,
                double usual) const {
    const std::string text = mimic.get(key);
    if (text.empty()) return usual;
    std::istringstream stream(text);
    double value = 0;
    if (!(stream >> value) || !(stream >> std::ws).eof() || !std::isfinite(value)) {
      fail(joint, "mimics another with a " + key + " of '" + text + "', which is no number");
    }
    return value;
  }

  void check(const JointCoupling& coupling, const XmlElement& robot) const {
    std::string known;
    bool found = false;
    for (const auto& joint : robot.children) {
      if (joint.tag != "joint" || joint.get("type") == "fixed") continue;
      found = found || joint.get("name") == coupling.leader;
      known += (known.empty() ? "" : ", ") + joint.get("name");
    }
    if (!found) {
      fail(coupling.follower,
           "mimics '" + coupling.leader + "', which is no joint that moves (known: " + known + ")");
    }
    std::string leader = coupling.leader;
    for (std::size_t steps = 0; steps <= couplings_.size(); ++steps) {
      if (leader == coupling.follower) fail(coupling.follower, "mimics itself");
      const auto next = std::ranges::find(couplings_, leader, &JointCoupling::follower);
      if (next == couplings_.end()) return;
      leader = next->leader;
    }
  }

  const SceneSource& urdf_;
  std::vector<JointCoupling> couplings_;
};

std::string number(double value) {
  std::ostringstream out;
  out.precision(15);
  out << value;
  return out.str();
}

}  // namespace

std::vector<JointCoupling> read_mimics(const SceneSource& urdf) { return MimicReader(urdf).read(); }

std::string with_couplings(const std::string& mjcf, const mjModel* model,
                           const std::vector<JointCoupling>& couplings) {
  XmlElement root = parse_xml(mjcf), equalities{"equality", {}, {}};
  const auto has = [model](const std::string& joint) {
    return mj_name2id(model, mjOBJ_JOINT, joint.c_str()) >= 0;
  };
  for (const auto& [follower, leader, multiplier, offset] : couplings) {
    if (!has(follower) || !has(leader)) continue;
    equalities.add({"joint",
                    {{"joint1", follower},
                     {"joint2", leader},
                     {"polycoef", number(offset) + " " + number(multiplier) + " 0 0 0"},
                     {"solref", "0.005 1"},
                     {"solimp", "0.95 0.99 0.001"}},
                    {}});
  }
  if (!equalities.children.empty()) root.add(std::move(equalities));
  return to_text(root);
}

void follow(const std::vector<JointCoupling>& couplings, const mjModel* model, std::vector<double>& qpos) {
  const auto at = [&](const std::string& name) {
    const int joint = mj_name2id(model, mjOBJ_JOINT, name.c_str());
    return joint < 0 ? nullptr : &qpos[static_cast<std::size_t>(model->jnt_qposadr[joint])];
  };
  for (std::size_t round = 0; round < couplings.size(); ++round) {  // leaders may follow others
    for (const auto& [follower, leader, multiplier, offset] : couplings) {
      double* const led = at(follower);
      const double* const leads = at(leader);
      if (led && leads) *led = offset + multiplier * *leads;
    }
  }
}

}  // namespace flowscope
