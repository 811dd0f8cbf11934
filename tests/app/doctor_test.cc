// flowscope doctor, and the device of the commands that draw.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "render/egl_device.h"
#include "tests/support/environment.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope::app {
namespace {

using nlohmann::json;
using testing::contains;
using testing::run_command;
using testing::Variable;

/// Holds a free port of 127.0.0.1.
class TakenPort {
 public:
  TakenPort() : file_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    ::bind(file_, reinterpret_cast<sockaddr*>(&at), size);
    ::listen(file_, 1);
    ::getsockname(file_, reinterpret_cast<sockaddr*>(&at), &size);
    number_ = ntohs(at.sin_port);
  }
  ~TakenPort() { ::close(file_); }
  std::string number() const { return std::to_string(number_); }

 private:
  int file_;
  std::uint16_t number_ = 0;
};

class Doctor : public ::testing::Test {
 protected:
  json examine(std::vector<std::string> more = {}) {
    std::vector<std::string> words{"doctor", "--json", "--data", folder_.path().string()};
    words.insert(words.end(), more.begin(), more.end());
    outcome_ = run_command(words);
    return json::parse(outcome_.out);
  }
  static json check_of(const json& report, const std::string& name) {
    for (const json& check : report.at("checks"))
      if (check.at("name") == name) return check;
    ADD_FAILURE() << "no check of " << name;
    return {};
  }
  const testing::TemporaryFolder folder_;
  testing::Outcome outcome_;
  Variable ours_{egl_device_variable}, mujoco_{"MUJOCO_EGL_DEVICE_ID"}, plain_{"EGL_DEVICE_ID"},
      port_{"FLOWSCOPE_PORT"};
};

TEST_F(Doctor, ListsEveryDeviceAndWhatRendersThere) {
  const json egl = check_of(examine(), "egl");
  EXPECT_EQ(egl.at("all").size(), egl_devices().size());
  EXPECT_TRUE(contains(egl.at("all").dump(), egl.at("found").get<std::string>())) << egl;
}

TEST_F(Doctor, ADeviceThatIsNotThereIsAFinding) {
  mujoco_.set("99");
  const json egl = check_of(examine(), "egl");
  EXPECT_EQ(outcome_.code, 1);
  EXPECT_FALSE(egl.at("ok"));
  EXPECT_TRUE(contains(egl.at("found"), "'99' (MUJOCO_EGL_DEVICE_ID)")) << egl;
  EXPECT_FALSE(egl.at("all").empty());
  EXPECT_TRUE(contains(check_of(examine({"--egl-device", "x"}), "egl").at("found"), "'x'"));
}

TEST_F(Doctor, FindsAPortInUse) {
  const TakenPort taken;
  const json asked = check_of(examine({"--port", taken.number()}), "port");
  EXPECT_EQ(outcome_.code, 1);
  EXPECT_FALSE(asked.at("ok"));
  EXPECT_TRUE(contains(asked.at("found"), "127.0.0.1:" + taken.number() + ": is in use")) << asked;
  EXPECT_TRUE(contains(asked.at("advice"), "--port")) << asked;
  port_.set(taken.number());
  EXPECT_FALSE(check_of(examine(), "port").at("ok"));
  EXPECT_TRUE(check_of(examine({"--port", "0"}), "port").at("ok"));
  EXPECT_FALSE(check_of(examine({"--port", "0", "--host", "203.0.113.1"}), "port").at("ok")) << "not ours";
}

TEST_F(Doctor, FindsFewDescriptors) {
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  rlimit few = before;
  few.rlim_cur = 120;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  const json files = check_of(examine(), "open files");
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_FALSE(files.at("ok"));
  EXPECT_TRUE(contains(files.at("found"), "120")) << files;
  EXPECT_TRUE(contains(files.at("advice"), "1024")) << files;
}

TEST_F(Doctor, CommandsThatDrawRefuseADeviceBeforeTheyBegin) {
  const std::string out = (folder_.path() / "p.png").string();
  const std::vector<std::vector<std::string>> calls{{"export", "png", "--demo", "x", "--out", out},
                                                    {"record", "push_buttons"},
                                                    {"eval", "--policy", "x", "--tasks", "x"},
                                                    {"serve", "--port", "0"},
                                                    {"demos", "render", "x", "--out", out},
                                                    {"demos", "export", "--npz", out},
                                                    {"demos", "trim", "x"}};
  for (auto words : calls) {
    words.insert(words.end(), {"--data", (folder_.path() / "data").string(), "--egl-device", "99"});
    if (words[0] == "eval") words.erase(words.end() - 4, words.end() - 2);
    const auto refused = run_command(words);
    EXPECT_EQ(refused.code, 2) << words[0] << ": " << refused.err;
    EXPECT_TRUE(contains(refused.err, "EGL device '99'")) << words[0] << ": " << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "data")) << words[0];
    ours_.set(std::nullopt);
  }
  EXPECT_EQ(run_command({"tasks"}).code, 0);
}

}  // namespace
}  // namespace flowscope::app
