// Models of a few shapes, compiled from a line of MJCF.
#pragma once

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "render/mujoco_owners.h"

namespace flowscope {

/// `body` goes into the worldbody; there are a material `lamp` and a mesh `pyramid`, 0.1 m along each axis.
inline ModelPtr tiny_model(const std::string& body) {
  const std::string path = testing::TempDir() + "tiny_scene_" + std::to_string(::getpid()) + ".xml";
  std::ofstream(path) << "<mujoco><compiler angle='radian'/><asset>"
                         "<material name='lamp' rgba='1 0 0 1'/>"
                         "<mesh name='pyramid' vertex='0 0 0  .1 0 0  0 .1 0  0 0 .1'/></asset><worldbody>"
                      << body << "</worldbody></mujoco>";
  char error[500] = "";
  ModelPtr model(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
  std::remove(path.c_str());
  EXPECT_TRUE(model) << error;
  return model;
}

inline DataPtr placed_data(const mjModel* model) {
  DataPtr data(mj_makeData(model));
  mj_kinematics(model, data.get());
  return data;
}

/// A body `b` (1) at `position` whose one geom has `attributes`, and a sensor box (site 0) of half size 0.1 m
/// at the origin.
inline ModelPtr shape_and_sensor(const std::string& attributes, const std::string& position) {
  return tiny_model("<site name='s' type='box' size='.1 .1 .1'/><body name='b' pos='" + position +
                    "'><geom " + attributes + "/></body>");
}

}  // namespace flowscope
