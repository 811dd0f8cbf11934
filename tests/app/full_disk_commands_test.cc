// The program itself on a full disk: exit code 1, the file's name, nothing left behind, and no signal at its
// end.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/child_program.h"
#include "tests/support/http_client.h"
#include "tests/support/run_command.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ChildProgram;
using testing::contains;
using testing::run_command;

using Words = std::vector<std::string>;

/// A data folder with a demonstration, a policy that took one step, a prediction and a mesh.
class Made {
 public:
  Made() {
    const auto recorded = run_command({"record", "push_buttons", "--data", data(), "--json"});
    if (recorded.code != 0) throw std::runtime_error(recorded.err);
    demo = json::parse(recorded.out).at("demos").at(0);
    run({"train", "--data", data(), "--policy", path("p.flow"), "--preset", "nano", "--steps", "1"});
    run({"predict", "--policy", path("p.flow"), "--data", data(), "--demo", demo, "--keyframe", "0",
         "--trace", path("t.json")});
    std::ofstream(path("ball.obj")) << testing::as_obj(testing::sphere(0.05, 12, 24));
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string data() const { return path("data"); }
  std::string demo;

 private:
  static void run(const Words& words) {
    const auto outcome = run_command(words);
    if (outcome.code != 0) throw std::runtime_error(words[0] + ": " + outcome.err);
  }
  const testing::TemporaryFolder folder_;
};

struct Row {
  const char* target;
  Words words;  ///< the target comes last
};

std::vector<Row> rows(const Made& made) {
  const Words small{"--data", made.data(), "--width", "128", "--height", "96"};
  const auto with = [&](Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const Words of_demo{"--demo", made.demo, "--out"}, of_trace{"--trace", made.path("t.json"), "--out"};
  return {
      {"p.png", with(with({"export", "png"}, small), of_demo)},
      {"c.ply", with({"export", "cloud", "--data", made.data()}, of_demo)},
      {"c.pcd", with({"export", "cloud", "--data", made.data()}, of_demo)},
      {"s.png", with(with({"export", "strip"}, small), of_trace)},
      {"f.mp4", with(with({"export", "mp4"}, small), of_trace)},
      {"frames", with(with({"demos", "render", made.demo}, small), {"--out"})},
      {"d.hdf5", {"demos", "export", "--data", made.data(), "--hdf5"}},
      {"d.npz", {"demos", "export", "--data", made.data(), "--npz"}},
      {"rlbench", {"demos", "export", "--data", made.data(), "--pictures", "keyframes", "--rlbench"}},
      {"t.json",
       {"predict", "--policy", made.path("p.flow"), "--data", made.data(), "--demo", made.demo, "--keyframe",
        "0", "--trace"}},
      {"q.flow", {"train", "--data", made.data(), "--preset", "nano", "--steps", "1", "--policy"}},
      {"w.safetensors", {"policy", "convert", made.path("p.flow")}},
      {"ball", {"scene", "import", made.path("ball.obj"), "--out"}},
  };
}

std::map<std::string, std::uint64_t> files(const fs::path& folder) {
  std::map<std::string, std::uint64_t> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    found[fs::relative(entry.path(), folder).string()] = entry.is_regular_file() ? entry.file_size() : 0;
  }
  return found;
}

void expect_refusal(const Row& row, const fs::path& folder, std::uint64_t room) {
  Words words = row.words;
  words.push_back((folder / row.target).string());
  ChildProgram program(FLOWSCOPE_PROGRAM, words, room);
  const std::string text = program.rest();
  EXPECT_EQ(program.wait(), 1) << text;
  EXPECT_TRUE(contains(text, "cannot write " + (folder / row.target).string())) << text;
  const auto left = files(folder);
  EXPECT_TRUE(left.empty()) << left.begin()->first;
}

TEST(FullDiskCommands, ExitOneNameTheFileAndLeaveNothing) {
  const Made made;
  for (const Row& row : rows(made)) {
    SCOPED_TRACE(row.target);
    const testing::TemporaryFolder whole, full;
    Words words = row.words;
    words.push_back((whole.path() / row.target).string());
    const auto outcome = run_command(words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    std::uint64_t largest = 0;
    for (const auto& [name, bytes] : files(whole.path())) largest = std::max(largest, bytes);
    expect_refusal(row, full.path(), largest / 2);
  }
}

TEST(FullDiskCommands, StandardOutputCountsToo) {
  const std::string program = FLOWSCOPE_PROGRAM;
  for (const std::string words : {" tasks", " tasks --json"}) {
    const int full = std::system((program + words + " > /dev/full 2> /dev/null").c_str());
    EXPECT_TRUE(WIFEXITED(full) && WEXITSTATUS(full) == 1) << words;
    const testing::TemporaryFolder folder;
    const std::string code = (folder.path() / "code").string();
    EXPECT_EQ(std::system(
                  ("{ " + program + words + "; echo $? > " + code + "; } | head -c 10 > /dev/null").c_str()),
              0);
    std::ifstream stream(code);
    int enough = -1;
    stream >> enough;
    EXPECT_EQ(enough, 0) << "a reader that has had enough is no failure:" << words;
  }
}

TEST(FullDiskCommands, ByHttpPredictionsAre507AndJobsFailWithACode) {
  const Made made;
  ChildProgram server(FLOWSCOPE_PROGRAM, {"serve", "--port", "0", "--no-token", "--data", made.data(),
                                          "--policy", made.path("p.flow")});
  const std::string line = server.line_with("flowscope: http://");
  ASSERT_FALSE(line.empty()) << server.rest();
  const auto port = static_cast<std::uint16_t>(std::stoi(line.substr(line.rfind(':') + 1)));
  const auto call = [&](const std::string& method, const std::string& target, const std::string& body = {}) {
    testing::Headers headers;
    if (!body.empty()) headers.emplace_back("Content-Type", "application/json");
    return testing::call(port, method, target, headers, body);
  };
  const auto job = [&](const std::string& target, const std::string& body) {
    const std::string id = json::parse(call("POST", target, body).body).at("job");
    for (;;) {
      const json status = json::parse(call("GET", "/api/v1/jobs/" + id).body);
      if (status.at("state") != "queued" && status.at("state") != "running") return status;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  };
  while (call("GET", "/health").status == 503) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  // Another placement: the present one lies in the store already.
  ASSERT_EQ(call("POST", "/api/v1/reset", R"({"task": "push_buttons", "seed": 7})").status, 200);
  const auto before = files(made.data());
  server.set_max_file_bytes(100);
  const auto predicted = call("POST", "/api/v1/predict", R"({"flow_steps": 2})");
  EXPECT_EQ(predicted.status, 507) << predicted.body;
  EXPECT_EQ(json::parse(predicted.body).at("error").at("code"), "disk_full") << predicted.body;
  for (const char* kind : {"png", "cloud"}) {
    const json status = job("/api/v1/export", json{{"kind", kind}}.dump());
    EXPECT_EQ(status.at("state"), "failed") << status;
    EXPECT_EQ(status.at("error").at("code"), "disk_full") << status;
  }
  const json recorded = job("/api/v1/script", R"({"record": true})");
  EXPECT_EQ(recorded.at("state"), "failed") << recorded;
  EXPECT_EQ(recorded.at("error").at("code"), "disk_full") << recorded;
  EXPECT_EQ(files(made.data()), before);
  server.set_max_file_bytes(RLIM_INFINITY);
  EXPECT_EQ(call("POST", "/api/v1/predict", R"({"flow_steps": 2})").status, 200);
  EXPECT_EQ(job("/api/v1/export", R"({"kind": "cloud"})").at("state"), "done");
}

}  // namespace
}  // namespace flowscope
