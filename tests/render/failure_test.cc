// What happens when MuJoCo or EGL cannot go on: exceptions that say why, never an exit, never a log file.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <thread>

#include "render/mujoco_guard.h"
#include "render/renderer.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

constexpr const char* ball =
    "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>";

TEST(MujocoGuard, ErrorsAreExceptions) {
  install_mujoco_guard();
  try {
    mju_error("the test says no");
    FAIL() << "came back";
  } catch (const std::runtime_error& e) {
    EXPECT_STREQ(e.what(), "MuJoCo: the test says no");
  }
}

TEST(MujocoGuard, ErrorsLeaveTheStepFunction) {
  install_mujoco_guard();
  const auto model = testing::compile(ball);
  const DataPtr data(mj_makeData(model.get()));
  data->nstack = 1;
  EXPECT_THROW(mj_step(model.get(), data.get()), std::runtime_error);
}

TEST(MujocoGuard, WarningsAreKeptPerThreadAndLeaveNoFile) {
  install_mujoco_guard();
  const testing::TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  take_mujoco_warning();
  mju_warning("careful");
  std::string elsewhere = "not asked";
  std::thread([&] { elsewhere = take_mujoco_warning(); }).join();
  std::filesystem::current_path(before);
  EXPECT_EQ(elsewhere, "");
  EXPECT_EQ(take_mujoco_warning(), "careful");
  EXPECT_EQ(take_mujoco_warning(), "");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

void probe_without_drivers() {
  ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json", 1);
  try {
    probe_egl();
  } catch (const std::runtime_error& e) {
    std::fputs(e.what(), stderr);
    std::_Exit(3);
  }
  std::_Exit(0);
}

TEST(EglDeathTest, NoDeviceIsAReadableError) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(probe_without_drivers(), ::testing::ExitedWithCode(3),
              "no EGL device can draw.*default display");
}

void destroy_elsewhere() {
  const auto model = testing::compile(ball);
  auto renderer = std::make_unique<Renderer>(model.get(), "ball", RendererOptions{64, 64, 0, false});
  std::thread([&] { renderer.reset(); }).join();
}

TEST(EglDeathTest, DestructionOnAForeignThreadStopsTheProgram) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(destroy_elsewhere(), "destroyed on a foreign thread");
}

TEST(Renderer, RefusesOptionsThatCannotBe) {
  const auto model = testing::compile(ball);
  EXPECT_THROW(Renderer(model.get(), "ball", {0, 64, 0, false}), std::invalid_argument);
  EXPECT_THROW(Renderer(nullptr, "ball", {64, 64, 0, false}), std::invalid_argument);
  EXPECT_ANY_THROW(Renderer(model.get(), "ball", {1000000, 64, 0, false}));
  EXPECT_NO_THROW(Renderer(model.get(), "ball", {64, 64, 0, false}));
}

}  // namespace
}  // namespace flowscope
