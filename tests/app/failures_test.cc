// What a user gets wrong and what a machine lacks: the exit code says whose fault it is, the message names
// the place, and nothing that was there is lost.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::contains;
using testing::Outcome;
using testing::run_command;

class Failures : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    const auto file = folder_.path() / name;
    std::ofstream(file) << text;
    return file.string();
  }
  Outcome record(const std::string& script) const {
    return run_command({"record", "push_buttons", "--script", script, "--data", data_, "--json"});
  }

  const testing::TemporaryFolder folder_;
  const std::string data_ = (folder_.path() / "data").string();
};

TEST_F(Failures, TextThatIsNotYamlIsNamedByFileLineAndColumn) {
  const std::string file = write("broken.yaml", "steps: [move: {frame: world\n  position: ]\n");
  const Outcome outcome = record(file);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, file + ":2:")) << outcome.err;
}

TEST_F(Failures, AnUnknownFrameIsNamedWithItsPlaceAndTheKnownOnes) {
  const std::string file =
      write("frame.yaml",
            "steps:\n"
            "  - gripper: open\n"
            "  - move: {frame: no_such_frame, position: [0, 0, 0.1], rpy_deg: [180, 0, 0]}\n");
  const Outcome outcome = record(file);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(
      contains(outcome.err, file + ":3:19: the scene has no frame 'no_such_frame' (known: world, tool, "))
      << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "table")) << outcome.err;
}

TEST_F(Failures, APoseOutOfReachFailsTheRunAndIsNamed) {
  const Outcome outcome = record(
      write("far.yaml", "steps:\n  - move: {frame: world, position: [3, 0, 1], rpy_deg: [180, 0, 0]}\n"));
  EXPECT_EQ(outcome.code, 1);
  const auto report = nlohmann::json::parse(outcome.out);
  const std::string reason = report.at("failed").at(0).at("reason");
  EXPECT_TRUE(contains(reason, "3.000") && contains(reason, "reach")) << reason;
}

TEST_F(Failures, APolicyThatIsNotThereIsNamed) {
  const Outcome outcome = run_command(
      {"serve", "--port", "0", "--data", data_, "--policy", (folder_.path() / "no.flow").string()});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, "no.flow")) << outcome.err;
  EXPECT_EQ(outcome.out, "");
}

/// A port of the loopback that is taken as long as this lives.
class TakenPort {
 public:
  TakenPort() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(socket_, generic, size) != 0 || ::listen(socket_, 1) != 0 ||
        ::getsockname(socket_, generic, &size) != 0) {
      throw std::runtime_error("no port to take");
    }
    port_ = ntohs(address.sin_port);
  }
  ~TakenPort() { ::close(socket_); }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  int port() const { return port_; }

 private:
  int socket_ = ::socket(AF_INET, SOCK_STREAM, 0);
  int port_ = 0;
};

TEST_F(Failures, APortInUseEndsServeWithTheAddress) {
  const TakenPort taken;
  const Outcome outcome = run_command({"serve", "--port", std::to_string(taken.port()), "--data", data_});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_TRUE(contains(outcome.err, "127.0.0.1:" + std::to_string(taken.port()))) << outcome.err;
  EXPECT_EQ(outcome.out, "") << "no address is promised";
}

/// In a process of its own: EGL looks for its drivers once.
void record_without_drivers() {
  ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json", 1);
  const testing::TemporaryFolder folder;
  const Outcome outcome = run_command({"record", "push_buttons", "--data", folder.path().string()});
  std::fputs(outcome.err.c_str(), stderr);
  std::_Exit(outcome.code + 40);
}

TEST(FailuresDeathTest, RecordWithoutADeviceThatDrawsSaysWhatToInstall) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(record_without_drivers(), ::testing::ExitedWithCode(41), "no EGL device can draw.*install");
}

}  // namespace
}  // namespace flowscope
