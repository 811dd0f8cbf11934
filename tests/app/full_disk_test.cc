// No space left: an error that says so, everything older intact, nothing half-written, and a server that goes
// on. A limit on the size of files stands in for the full disk: writes fail in the middle in the same way.
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "recorder/demo_file.h"
#include "recorder/demo_store.h"
#include "tests/support/child_program.h"
#include "tests/support/http_client.h"
#include "tests/support/run_command.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using nlohmann::json;
using testing::ChildProgram;
using testing::contains;

constexpr std::uint64_t kTooSmall = 40'000, kUnlimited = RLIM_INFINITY;

std::size_t entries(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(FullDisk, RecordSaysSoAndLeavesNothingHalfWritten) {
  const testing::TemporaryFolder folder;
  const DemoStore store(folder.path());
  const std::string older = store.save(testing::sample_demo());
  const Bytes before = read_demo_bytes(store.path(older));
  ChildProgram recorder(FLOWSCOPE_PROGRAM, {"record", "push_buttons", "--data", folder.path().string()},
                        kTooSmall);
  const std::string text = recorder.rest();
  EXPECT_EQ(recorder.wait(), 1) << text;
  EXPECT_TRUE(contains(text, "cannot write") && contains(text, "push_buttons-0001.demo")) << text;
  EXPECT_EQ(read_demo_bytes(store.path(older)), before);
  EXPECT_EQ(entries(folder.path() / "demos"), 1u) << "no leftovers";
  EXPECT_TRUE(store.check().empty());
}

/// One real server for the tests that ask it.
class Served : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new testing::TemporaryFolder;
    server_ = new ChildProgram(FLOWSCOPE_PROGRAM,
                               {"serve", "--port", "0", "--no-token", "--data", folder_->path().string()});
    const std::string line = server_->line_with("flowscope: http://");
    const std::size_t colon = line.rfind(':');
    if (colon == std::string::npos) throw std::runtime_error("no server: " + server_->rest());
    port_ = static_cast<std::uint16_t>(std::stoi(line.substr(colon + 1)));
    while (call("GET", "/health").status == 503) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  static void TearDownTestSuite() {
    delete server_;
    delete folder_;
  }
  static testing::Reply call(const std::string& method, const std::string& target,
                             const std::string& body = {}) {
    testing::Headers headers;
    if (!body.empty()) headers.emplace_back("Content-Type", "application/json");
    return testing::call(port_, method, target, headers, body);
  }
  /// Records one demonstration; the job at its end.
  static json record() {
    const auto started = call("POST", "/api/v1/script", R"({"record": true})");
    const std::string job = json::parse(started.body).at("job");
    for (;;) {
      const json status = json::parse(call("GET", "/api/v1/jobs/" + job).body);
      if (status.at("state") != "queued" && status.at("state") != "running") return status;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  static std::string data() { return folder_->path().string(); }

  static inline testing::TemporaryFolder* folder_ = nullptr;
  static inline ChildProgram* server_ = nullptr;
  static inline std::uint16_t port_ = 0;
};

TEST_F(Served, AFullDiskFailsTheJobAndTheWorldGoesOn) {
  const json first = record();
  ASSERT_EQ(first.at("state"), "done") << first;
  EXPECT_EQ(call("POST", "/api/v1/reset", R"({"task": "push_buttons", "seed": 2})").status, 200);
  server_->set_max_file_bytes(kTooSmall);
  const json second = record();
  EXPECT_EQ(second.at("state"), "failed") << second;
  EXPECT_TRUE(contains(second.dump(), "cannot write")) << second;
  EXPECT_EQ(call("GET", "/api/v1/state").status, 200);
  EXPECT_EQ(call("POST", "/api/v1/reset", R"({"task": "push_buttons", "seed": 3})").status, 200);
  EXPECT_EQ(call("GET", "/snapshot").status, 200);
  server_->set_max_file_bytes(kUnlimited);
  const json third = record();
  EXPECT_EQ(third.at("state"), "done") << third;
  const DemoStore store(folder_->path());
  EXPECT_EQ(store.list().size(), 2u);
  EXPECT_TRUE(store.check().empty());
  EXPECT_EQ(entries(folder_->path() / "demos"), 2u) << "no leftovers";
}

TEST_F(Served, ASecondWriterIsToldWhoTheFirstIsAndReadersGoOn) {
  const std::string first = "flowscope serve (process " + std::to_string(server_->pid()) + ", since 20";
  const auto id = DemoStore(folder_->path()).save(testing::sample_demo());
  const std::vector<std::vector<std::string>> writers = {
      {"record", "push_buttons"}, {"serve", "--port", "0"}, {"demos", "delete", id},
      {"demos", "bin", "empty"},  {"demos", "trim", id},    {"demos", "merge", data() + "/../other"}};
  std::filesystem::create_directories(data() + "/../other/demos");
  for (auto words : writers) {
    words.insert(words.end(), {"--data", data()});
    const auto outcome = testing::run_command(words);
    EXPECT_EQ(outcome.code, 1) << words[0] << " " << words[1];
    EXPECT_TRUE(contains(outcome.err, first)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
  for (const char* reader : {"list", "stats"}) {
    EXPECT_EQ(testing::run_command({"demos", reader, "--data", data()}).code, 0) << reader;
  }
  EXPECT_EQ(testing::run_command({"demos", "trim", "--dry-run", "--all", "--data", data()}).code, 0);
  std::filesystem::remove_all(data() + "/../other");
}

TEST_F(Served, WhatThePageDeletesLiesInTheBin) {
  const DemoStore store(folder_->path());
  EXPECT_EQ(call("POST", "/api/v1/reset", R"({"task": "push_buttons", "seed": 9})").status, 200);
  const json job = record();
  ASSERT_EQ(job.at("state"), "done") << job;
  const std::string id = job.at("result").at("demo");
  EXPECT_LT(call("DELETE", "/api/v1/demos/" + id).status, 300);
  EXPECT_FALSE(std::filesystem::exists(store.path(id)));
  ASSERT_FALSE(store.bin().list().empty());
  EXPECT_EQ(store.bin().list().back().info.id, id);
}

}  // namespace
}  // namespace flowscope
