// Six-joint arms with the hands that public model collections have, written here for the tests: a tendon that
// pulls two fingers by inputs from 0 to 255 (Panda), the same over four-bar linkages (xArm), and over
// linkages with couplers and springs (2F-85).
#pragma once

#include <string>

namespace flowscope::testing {

struct HandModel {
  std::string fingers;  ///< bodies below the hand
  std::string tendon, equality, actuator, contact;
  std::string description;  ///< the fingers' lines of a robot's description
  double reach = 0.09;      ///< of the tool before the hand, m
};

/// Two slides of 0.04 m.
inline HandModel slide_hand() {
  const auto finger = [](const std::string& name, const std::string& joint, const std::string& side) {
    return "<body name='" + name + "' pos='0 0 .05'><joint name='" + joint + "' type='slide' axis='0 " +
           side +
           "1 0' range='0 .04' damping='5' armature='.05'/><geom type='box' size='.008 .006 .03' pos='0 " +
           side + ".006 .02' mass='.05'/></body>";
  };
  HandModel hand;
  hand.fingers = finger("lf", "f1", "") + finger("rf", "f2", "-");
  hand.tendon = "<fixed name='split'><joint joint='f1' coef='.5'/><joint joint='f2' coef='.5'/></fixed>";
  hand.equality = "<joint joint1='f1' joint2='f2' solimp='.95 .99 .001' solref='.005 1'/>";
  hand.actuator =
      "<general name='grip' tendon='split' forcerange='-100 100' ctrlrange='0 255' gainprm='0.01568627451' "
      "biastype='affine' biasprm='0 -100 -10'/>";
  hand.description =
      "    - {joint: f1, actuator: grip, open: 0.04, closed: 0, command_open: 255, command_closed: 0}\n"
      "    - {joint: f2, open: 0.04, closed: 0}\n";
  return hand;
}

/// A crank, the finger on it, and an inner knuckle that keeps the finger parallel.
inline HandModel four_bar_hand() {
  const auto side = [](const std::string& s, const std::string& y) {
    const std::string inwards = y.empty() ? "-" : "", turn = y.empty() ? "1" : "-1",
                      back = y.empty() ? "-1" : "1";
    return "<body name='" + s + "_crank' pos='0 " + y + ".032 .05'><joint name='" + s + "_driver' axis='" +
           turn +
           " 0 0' range='0 .85' armature='.005' damping='.1'/><geom type='capsule' size='.006' fromto='0 0 0 "
           "0 " +
           y + ".034 .040' mass='.03'/><body name='" + s + "_finger' pos='0 " + y +
           ".034 .040'><joint name='" + s + "_tip' axis='" + back +
           " 0 0' range='0 .85'/><geom type='box' size='.012 .003 .02' pos='0 " + inwards +
           ".022 .04' mass='.05'/><geom type='capsule' size='.005' fromto='0 0 0 0 " + inwards +
           ".018 .03' mass='.02'/></body></body><body name='" + s + "_inner' pos='0 " + y +
           ".018 .064'><joint name='" + s + "_knuckle' axis='" + turn +
           " 0 0' range='0 .85' stiffness='.05' springref='2.6' armature='.001' damping='.002'/>"
           "<geom type='capsule' size='.004' fromto='0 0 0 0 " +
           y + ".034 .040' mass='.02'/></body>";
  };
  HandModel hand;
  hand.fingers = side("left", "") + side("right", "-");
  hand.tendon =
      "<fixed name='split'><joint joint='right_driver' coef='.5'/><joint joint='left_driver' "
      "coef='.5'/></fixed>";
  hand.equality =
      "<connect body1='right_finger' body2='right_inner' anchor='0 .014 .014' solref='.005 1'/>"
      "<connect body1='left_finger' body2='left_inner' anchor='0 -.014 .014' solref='.005 1'/>"
      "<joint joint1='left_driver' joint2='right_driver' polycoef='0 1 0 0 0' solref='.005 1'/>";
  hand.actuator =
      "<general name='grip' tendon='split' forcerange='-50 50' ctrlrange='0 255' gainprm='.33333' "
      "biastype='affine' "
      "biasprm='0 -100 -10'/>";
  for (const std::string s : {"left", "right"}) {
    for (const std::string part : {"_crank", "_finger"})
      hand.contact += "<exclude body1='" + s + "_inner' body2='" + s + part + "'/>";
    for (const std::string part : {"_crank", "_inner"})
      hand.contact += "<exclude body1='hand' body2='" + s + part + "'/>";
  }
  hand.contact += "<exclude body1='left_finger' body2='right_finger'/>";
  hand.description =
      "    - {joint: right_driver, actuator: grip, open: 0, closed: 0.85, command_open: 0, command_closed: "
      "255}\n"
      "    - {joint: left_driver, open: 0, closed: 0.85}\n";
  hand.reach = 0.14;
  return hand;
}

/// A crank with a coupler, and a spring link that carries the finger, which the coupler pulls along.
inline HandModel coupler_hand() {
  const auto side = [](const std::string& s, const std::string& y, const std::string& turned) {
    return "<body name='" + s + "_driver' pos='0 " + y + ".030 .05'" + turned + "><joint name='" + s +
           "_driver_joint' axis='1 0 0' range='0 .8' armature='.005' damping='.1' solreflimit='.005 1' "
           "solimplimit='.95 .99 .001'/><geom type='capsule' size='.005' fromto='0 0 0 0 .031 -.004' "
           "mass='.009'/>"
           "<body name='" +
           s + "_coupler' pos='0 .031 -.004'><joint name='" + s +
           "_coupler_joint' axis='1 0 0' range='-1.57 0' armature='.001' damping='.005' solreflimit='.005 1' "
           "solimplimit='.95 .99 .001'/>"
           "<geom type='capsule' size='.004' fromto='0 0 0 0 .006 .046' mass='.014'/></body></body>"
           "<body name='" +
           s + "_spring' pos='0 " + y + ".012 .056'" + turned + "><joint name='" + s +
           "_spring_joint' axis='1 0 0' range='-.3 .8' stiffness='.05' springref='2.6' armature='.001' "
           "damping='.005'/>"
           "<geom type='capsule' size='.004' fromto='0 0 0 0 .037 .042' mass='.022'/>"
           "<body name='" +
           s + "_follower' pos='0 .055 .036'><joint name='" + s +
           "_follower_joint' axis='1 0 0' pos='0 -.018 .0065' range='-.87 .87' armature='.001' "
           "damping='.005' solreflimit='.005 1' "
           "solimplimit='.95 .99 .001'/><geom type='box' size='.011 .004 .0187' pos='0 -.0215 .032' "
           "mass='.016' "
           "friction='.7'/></body></body>";
  };
  HandModel hand;
  hand.fingers = side("right", "", "") + side("left", "-", " quat='0 0 0 1'");
  hand.tendon =
      "<fixed name='split'><joint joint='right_driver_joint' coef='.5'/><joint joint='left_driver_joint' "
      "coef='.5'/></fixed>";
  hand.equality =
      "<connect body1='right_follower' body2='right_coupler' anchor='0 0 0' solref='.005 1' solimp='.95 .99 "
      ".001'/>"
      "<connect body1='left_follower' body2='left_coupler' anchor='0 0 0' solref='.005 1' solimp='.95 .99 "
      ".001'/>"
      "<joint joint1='right_driver_joint' joint2='left_driver_joint' solref='.005 1' solimp='.95 .99 .001'/>";
  hand.actuator =
      "<general name='fingers_actuator' tendon='split' forcerange='-5 5' ctrlrange='0 255' "
      "gainprm='.3137255' "
      "biastype='affine' biasprm='0 -100 -10'/>";
  for (const std::string s : {"left", "right"}) {
    for (const std::string part : {"_driver", "_spring"})
      hand.contact += "<exclude body1='hand' body2='" + s + part + "'/>";
    for (const std::string part : {"_coupler", "_driver", "_spring"})
      hand.contact += "<exclude body1='" + s + "_follower' body2='" + s + part + "'/>";
    for (const std::string part : {"_coupler", "_driver"})
      hand.contact += "<exclude body1='" + s + "_spring' body2='" + s + part + "'/>";
  }
  hand.description =
      "    - {joint: right_driver_joint, actuator: fingers_actuator, open: 0, closed: 0.8, command_open: 0, "
      "command_closed: 255}\n"
      "    - {joint: left_driver_joint, open: 0, closed: 0.8}\n";
  hand.reach = 0.125;
  return hand;
}

/// A position servo of an arm's joint, as MJCF.
inline std::string arm_servo(const std::string& joint, const std::string& name) {
  return "<general name='" + name + "' joint='" + joint +
         "' biastype='affine' gainprm='2000' biasprm='0 -2000 -200'/>";
}
inline std::string arm_servos() {
  std::string text;
  for (const std::string i : {"1", "2", "3", "4", "5", "6"}) text += arm_servo("j" + i, "a" + i);
  return text;
}

/// The arm with a hand over a floor with a cube of 40 mm. `servos` drive the arm.
inline std::string arm_scene(const HandModel& hand, const std::string& servos = arm_servos(),
                             const std::string& more_bodies = "", const std::string& more_equalities = "") {
  const std::string reach = std::to_string(hand.reach);
  return "<mujoco><compiler angle='radian' autolimits='true'/><option timestep='.002'/><worldbody>\n"
         "<geom name='floor' type='plane' size='2 2 .1'/>\n"
         "<body name='base' pos='-.3 0 0'><geom type='cylinder' size='.06 .05' pos='0 0 .05'/>\n"
         "<body name='l1' pos='0 0 .1'><joint name='j1' axis='0 0 1' range='-3 3' armature='.3' damping='2'/>"
         "<geom type='capsule' fromto='0 0 0 0 0 .2' size='.045' mass='2'/>\n"
         "<body name='l2' pos='0 0 .2'><joint name='j2' axis='0 1 0' range='-2 2' armature='.3' damping='2'/>"
         "<geom type='capsule' fromto='0 0 .05 0 0 .3' size='.04' mass='2'/>\n"
         "<body name='l3' pos='0 0 .35'><joint name='j3' axis='0 1 0' range='-2.6 2.6' armature='.3' "
         "damping='2'/>"
         "<geom type='capsule' fromto='0 0 .05 0 0 .25' size='.035' mass='1'/>\n"
         "<body name='l4' pos='0 0 .3'><joint name='j4' axis='0 0 1' range='-3 3' armature='.3' damping='2'/>"
         "<geom type='capsule' fromto='0 0 .02 0 0 .06' size='.03' mass='.5'/>\n"
         "<body name='l5' pos='0 0 .08'><joint name='j5' axis='0 1 0' range='-2.2 2.2' armature='.3' "
         "damping='2'/>"
         "<geom type='capsule' fromto='0 0 .02 0 0 .06' size='.03' mass='.5'/>\n"
         "<body name='hand' pos='0 0 .1'><joint name='j6' axis='0 0 1' range='-3 3' armature='.3' "
         "damping='2'/>"
         "<geom type='box' size='.03 .06 .02' mass='.4'/>\n"
         "<site name='tcp' pos='0 0 " +
         reach + "'/><site name='grip_box' type='box' size='.012 .03 .02' pos='0 0 " + reach + "'/>\n" +
         hand.fingers +
         "</body></body></body></body></body></body></body>\n"
         "<body name='cube' pos='.2 .1 .02'><freejoint/><geom type='box' size='.02 .02 .02' "
         "mass='.05'/></body>\n" +
         more_bodies + "</worldbody><contact>" + hand.contact + "</contact><tendon>" + hand.tendon +
         "</tendon><equality>" + hand.equality + more_equalities + "</equality><actuator>" + servos +
         hand.actuator + "</actuator></mujoco>";
}

/// Fits arm_scene; ten lines before the fingers'.
inline std::string arm_description(const HandModel& hand) {
  return "joints: [j1, j2, j3, j4, j5, j6]\n"
         "actuators: [a1, a2, a3, a4, a5, a6]\n"
         "home: [0, 0.4, 1.4, 0, 1.3, 0]\n"
         "tool: tcp\n"
         "attach: grip_box\n"
         "hand: hand\n"
         "inverse_kinematics: numeric\n"
         "limits: {velocity: 1.5, acceleration: 6, deceleration: 3}\n"
         "gripper:\n"
         "  fingers:\n" +
         hand.description + "  squeeze: 0.002\n";
}

}  // namespace flowscope::testing
