// Which device draws: the environment chooses, and what is not there is an error that lists what is.
#include "render/egl_device.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <system_error>

#include "render/renderer.h"
#include "tests/support/environment.h"

namespace flowscope {
namespace {

using testing::Variable;

class EglChoice : public ::testing::Test {
 protected:
  static bool has_device_0(bool drawing = false) {
    return std::ranges::any_of(egl_devices(), [&](const EglDevice& d) {
      return d.name == "device 0" && (!drawing || d.problem.empty());
    });
  }
  Variable ours_{egl_device_variable}, mujoco_{"MUJOCO_EGL_DEVICE_ID"}, plain_{"EGL_DEVICE_ID"};
};

TEST_F(EglChoice, ListsEveryWayToAPictureWithWhoDraws) {
  const auto devices = egl_devices();
  ASSERT_FALSE(devices.empty());
  const auto drawing = std::ranges::find_if(devices, [](const EglDevice& d) { return d.problem.empty(); });
  ASSERT_NE(drawing, devices.end());
  EXPECT_NE(drawing->renderer.find("OpenGL "), std::string::npos);
  EXPECT_EQ(probe_egl().platform, drawing->name) << "the first that can";
  EXPECT_EQ(describe({"device 3", "", "no display"}), "device 3: cannot draw: no display");
}

TEST_F(EglChoice, WhatIsNotThereIsNamedTogetherWithWhatIs) {
  for (Variable* variable : {&ours_, &mujoco_, &plain_}) {
    for (const char* text : {"99", "-1", "gpu", "0,1", " 0", "0x0", "1.0", "99999999999999999999"}) {
      variable->set(text);
      try {
        chosen_egl_device();
        ADD_FAILURE() << text << " was taken";
      } catch (const BadEglDevice& error) {
        const std::string what = error.what();
        EXPECT_NE(what.find("'" + std::string(text) + "'"), std::string::npos) << what;
        EXPECT_NE(what.find("EGL_DEVICE"), std::string::npos) << what;
        EXPECT_EQ(what.find("device 0: ") != std::string::npos, has_device_0()) << what;
      }
      EXPECT_THROW(probe_egl(), BadEglDevice) << text;
    }
    variable->set(std::nullopt);
  }
}

TEST_F(EglChoice, OursBeforeMujocosBeforeThePlainOneAndEmptyIsUnset) {
  plain_.set("97"), mujoco_.set("98"), ours_.set("99");
  const auto named = [] {
    try {
      chosen_egl_device();
    } catch (const BadEglDevice& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(named().find("'99' (FLOWSCOPE_EGL_DEVICE)"), std::string::npos) << named();
  ours_.set("");
  EXPECT_NE(named().find("'98' (MUJOCO_EGL_DEVICE_ID)"), std::string::npos) << named();
  mujoco_.set("");
  EXPECT_NE(named().find("'97' (EGL_DEVICE_ID)"), std::string::npos) << named();
  plain_.set("");
  EXPECT_EQ(chosen_egl_device(), std::nullopt);
}

TEST_F(EglChoice, TheChosenOneDraws) {
  if (!has_device_0(/*drawing=*/true)) {
    ours_.set("0");
    EXPECT_THROW(probe_egl(), std::runtime_error) << "no other one takes its place";
    GTEST_SKIP() << "device 0 draws nothing here";
  }
  for (Variable* variable : {&ours_, &mujoco_, &plain_}) {
    variable->set("0");
    EXPECT_EQ(chosen_egl_device(), 0);
    EXPECT_EQ(probe_egl().platform, "device 0");
    variable->set(std::nullopt);
  }
}

}  // namespace
}  // namespace flowscope
