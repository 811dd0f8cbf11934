// The outside of the program: exit codes, what goes to which stream, environment twins.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "recorder/demo_store.h"
#include "tests/support/run_command.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope::app {
namespace {

using nlohmann::json;

using testing::contains;
using testing::Outcome;

Outcome run(std::vector<std::string> words) { return testing::run_command(std::move(words)); }

TEST(Cli, EveryCommandHasHelp) {
  for (const char* command : {"serve", "tasks", "record", "demos", "train", "predict", "eval", "export",
                              "bench", "doctor", "ablate", "policy"}) {
    const Outcome outcome = run({command, "--help"});
    EXPECT_EQ(outcome.code, 0) << command;
    EXPECT_TRUE(contains(outcome.out, "Usage")) << command << ": " << outcome.out;
    EXPECT_EQ(outcome.err, "") << command;
  }
}

TEST(Cli, AWrongCallIsTwoAndNamesTheOption) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> calls = {
      {{"nosuch"}, "nosuch"},
      {{"record"}, "task"},
      {{"record", "push_buttons", "--episodes", "0"}, "--episodes"},
      {{"record", "push_buttons", "--nonsense"}, "--nonsense"},
      {{"demos", "list", "--data", "/no/such/folder"}, "--data"},
      {{"train", "--data", "/no/such/folder", "--policy", "p.flow", "--steps", "1"}, "--data"}};
  for (const auto& [call, name] : calls) {
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.code, 2) << call.front();
    EXPECT_TRUE(contains(outcome.err, name)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_EQ(run({}).code, 2);
}

TEST(Cli, AFailureWithJsonIsStillOneDocument) {
  const Outcome outcome = run({"demos", "list", "--data", "/no/such/folder", "--json"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(json::parse(outcome.out)["error"]["code"], "bad_call");
}

class CliDemos : public ::testing::Test {
 protected:
  const testing::TemporaryFolder folder_;
  const std::string data_ = folder_.path().string();
  const DemoStore store_{folder_.path()};
};

TEST_F(CliDemos, ListShowAndDelete) {
  const std::string id = store_.save(testing::sample_demo());
  const json list = json::parse(run({"demos", "list", "--data", data_, "--json"}).out);
  ASSERT_EQ(list["demos"].size(), 1u);
  for (const char* key :
       {"id", "task", "variation", "seed", "instruction", "frames", "keyframes", "created", "bytes"}) {
    EXPECT_TRUE(list["demos"][0].contains(key)) << key;
  }
  EXPECT_TRUE(contains(run({"demos", "show", id, "--data", data_}).out, "keyframe 1"));

  const Outcome half = run({"demos", "delete", id, "unknown", "--data", data_});
  EXPECT_EQ(half.code, 2);
  EXPECT_EQ(store_.list().size(), 1u) << "one unknown id must keep all others";
  EXPECT_EQ(run({"demos", "delete", id, "--data", data_}).code, 0);
  EXPECT_TRUE(store_.list().empty());
  EXPECT_EQ(run({"demos", "show", id, "--data", data_}).code, 2);
}

TEST_F(CliDemos, CheckFailsForADamagedFile) {
  const std::string id = store_.save(testing::sample_demo());
  EXPECT_EQ(run({"demos", "check", "--data", data_}).code, 0);
  std::fstream file(store_.path(id), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(3000);
  file.put('?');
  file.close();
  const Outcome outcome = run({"demos", "check", "--data", data_, "--json"});
  EXPECT_EQ(outcome.code, 1);
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["checked"], 1);
  EXPECT_EQ(report["bad"][0]["id"], id);
  EXPECT_TRUE(contains(outcome.err, id));
}

TEST_F(CliDemos, EveryOptionHasAnEnvironmentTwin) {
  store_.save(testing::sample_demo());
  ::setenv("FLOWSCOPE_DATA", data_.c_str(), 1);
  ::setenv("FLOWSCOPE_JSON", "true", 1);
  const Outcome outcome = run({"demos", "list"});
  ::setenv("FLOWSCOPE_DATA", "/no/such/folder", 1);
  const Outcome given = run({"demos", "list", "--data", data_});
  ::unsetenv("FLOWSCOPE_DATA");
  ::unsetenv("FLOWSCOPE_JSON");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["demos"].size(), 1u);
  EXPECT_EQ(given.code, 0) << "the option wins: " << given.err;
}

}  // namespace
}  // namespace flowscope::app
