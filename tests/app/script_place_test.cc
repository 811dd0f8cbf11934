// A script that cannot run is answered with its place, and nothing starts.
#include <gtest/gtest.h>

#include "app/studio.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

class ScriptPlace : public ::testing::Test {
 protected:
  ScriptPlace() : studio_({find_assets(), folder_.path(), "push_buttons", "", nullptr}) {
    studio_.reset("push_buttons", 0, 1);
  }
  web::ApiError refusal(const std::string& text) {
    try {
      studio_.run_script({text, "", false});
    } catch (const web::ApiError& error) {
      return error;
    }
    ADD_FAILURE() << "was started: " << text;
    return {0, "", ""};
  }
  const testing::TemporaryFolder folder_;
  Studio studio_;
};

TEST_F(ScriptPlace, IsFileLineAndColumn) {
  const std::string steps = "steps:\n- gripper: close\n";
  const std::vector<std::tuple<std::string, std::string, int, std::string>> scripts{
      {steps + "- move: {frame: teapot, position: [0, 0, 0], rpy_deg: [0, 0, 0]}\n", "bad_script", 400,
       "script:3:17"},
      {steps + "- wave: hello\n", "bad_script", 400, "script:3:3"},
      {"task: juggling\n" + steps, "bad_script", 400, "script:1:7"},
      {"task: open_drawer\n" + steps, "other_task", 409, "script:1:7"}};
  for (const auto& [text, code, status, where] : scripts) {
    const web::ApiError error = refusal(text);
    EXPECT_EQ(error.code, code) << error.what();
    EXPECT_EQ(error.status, status);
    EXPECT_EQ(error.where, where);
  }
  EXPECT_TRUE(studio_.jobs().empty());
}

}  // namespace
}  // namespace flowscope
