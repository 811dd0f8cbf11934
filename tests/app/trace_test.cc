// From a recorded demonstration to a flow trace: the numbers in the file are the numbers of the method, and
// come again.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using nlohmann::json;
using testing::contains;
using testing::Outcome;
using testing::run_command;

json read_json(const std::filesystem::path& file) { return json::parse(std::ifstream(file)); }

/// One demonstration and a network that took a few steps on it, made once for all tests of the suite.
class TraceTest : public ::testing::Test {
 protected:
  static void prepare() {
    folder_ = std::make_unique<testing::TemporaryFolder>();
    const Outcome recorded =
        run_command({"record", "push_buttons", "--seed", "3", "--data", data(), "--json"});
    ASSERT_EQ(recorded.code, 0) << recorded.err;
    const Outcome trained = run_command({"train", "--data", data(), "--policy", policy(), "--preset", "nano",
                                         "--steps", "4", "--seed", "1", "--json"});
    ASSERT_EQ(trained.code, 0) << trained.err;
    ASSERT_EQ(json::parse(trained.out).at("steps"), 4);
    demo_ = json::parse(recorded.out).at("demos").at(0);
  }
  // Not in SetUpTestSuite: what fails there skips the tests instead of failing them.
  void SetUp() override {
    if (!folder_) {
      ASSERT_NO_FATAL_FAILURE(prepare());
    }
    ASSERT_FALSE(demo_.empty());
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string data() { return folder_->path().string(); }
  static std::string policy() { return (folder_->path() / "nano.flow").string(); }

  static std::filesystem::path trace_file(const std::string& name) {
    return folder_->path() / (name + ".json");
  }
  static std::vector<std::string> predict_words(const std::filesystem::path& file,
                                                const std::vector<std::string>& options = {},
                                                const std::string& seed = "11") {
    std::vector<std::string> words = {"predict", "--policy", policy(),      "--data", data(),
                                      "--demo",  demo_,      "--seed",      seed,     "--keyframe",
                                      "1",       "--trace",  file.string(), "--json"};
    words.insert(words.end(), options.begin(), options.end());
    return words;
  }
  /// In a program start of its own.
  static json predict_in_new_process(const std::string& name) {
    const auto file = trace_file(name);
    std::string command = FLOWSCOPE_PROGRAM;
    for (const std::string& word : predict_words(file)) command += " '" + word + "'";
    EXPECT_EQ(std::system((command + " > " + file.string() + ".out").c_str()), 0);
    return read_json(file);
  }
  static json predict(const std::string& name, const std::vector<std::string>& options = {},
                      const std::string& seed = "11") {
    const auto file = trace_file(name);
    const Outcome outcome = run_command(predict_words(file, options, seed));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const json written = read_json(file);
    EXPECT_EQ(json::parse(outcome.out), written) << "the file and stdout say the same";
    return written;
  }

  inline static std::unique_ptr<testing::TemporaryFolder> folder_;
  inline static std::string demo_;
};

json without_time(json trace) {
  trace.erase("id");
  trace.erase("created");
  for (auto& step : trace["steps"]) step.erase("ms");
  return trace;
}

TEST_F(TraceTest, TheSameSeedGivesTheSameNumbersBitForBit) {
  const json first = predict("first"), second = predict("second");
  EXPECT_EQ(without_time(first), without_time(second));
  EXPECT_NE(first["steps"][0]["x"], predict("other", {}, "12")["steps"][0]["x"]);
}

TEST_F(TraceTest, AnotherProgramStartGivesTheSameNumbersBitForBit) {
  const json first = without_time(predict_in_new_process("start_1"));
  EXPECT_EQ(first, without_time(predict_in_new_process("start_2")));
  EXPECT_EQ(first, without_time(predict("here")));
}

void expect_steps_of_velocity(const json& trace) {
  const json& steps = trace["steps"];
  EXPECT_EQ(steps.front()["t"], 0.0);
  EXPECT_EQ(steps.back()["t"], 1.0);
  for (std::size_t k = 0; k + 1 < steps.size(); ++k) {
    EXPECT_EQ(steps[k]["k"], k);
    const double dt = steps[k + 1]["t"].get<double>() - steps[k]["t"].get<double>();
    EXPECT_NEAR(dt, 0.2, 1e-12);
    double moved = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      const double v = steps[k]["velocity"][i], x = steps[k]["x"][i], next = steps[k + 1]["x"][i];
      EXPECT_NEAR(next, x + v * dt, 1e-12) << "step " << k << ", number " << i;
      moved += std::abs(v);
    }
    EXPECT_GT(moved, 0) << "step " << k;
  }
  EXPECT_EQ(steps.back()["pose"]["position"], trace["result"]["position"]);
  EXPECT_EQ(steps.back()["pose"]["quaternion"], trace["result"]["quaternion"]);
}

TEST_F(TraceTest, EveryStepIsTheVelocityTimesItsTimeWithEveryIntegrator) {
  for (const std::string integrator : {"euler", "midpoint", "rk4"}) {
    const json trace = predict(integrator, {"--flow-steps", "5", "--integrator", integrator});
    ASSERT_EQ(trace["steps"].size(), 6u);
    EXPECT_EQ(trace["integrator"], integrator);
    expect_steps_of_velocity(trace);
  }
  EXPECT_EQ(without_time(predict("default")), without_time(predict("named", {"--integrator", "euler"})));
}

TEST_F(TraceTest, ATransformerThatDiffusesIsTrainedAndPredicts) {
  const std::string file = (folder_->path() / "ddpm.flow").string();
  const Outcome trained =
      run_command({"train", "--data", data(), "--policy", file, "--preset", "nano", "--steps", "2",
                   "--backbone", "transformer", "--objective", "ddpm", "--json"});
  ASSERT_EQ(trained.code, 0) << trained.err;
  const auto call = [&](const std::string& name, const std::vector<std::string>& options) {
    std::vector<std::string> words = predict_words(trace_file(name), options);
    words[2] = file;
    return run_command(words);
  };
  const Outcome predicted = call("ddpm", {"--flow-steps", "5"});
  ASSERT_EQ(predicted.code, 0) << predicted.err;
  const json trace = json::parse(predicted.out);
  EXPECT_EQ(trace["policy"]["objective"], "ddpm");
  EXPECT_EQ(trace["policy"]["backbone"], "transformer");
  expect_steps_of_velocity(trace);
  EXPECT_EQ(without_time(trace), without_time(json::parse(call("again", {"--flow-steps", "5"}).out)));

  const Outcome refused = call("no", {"--integrator", "rk4"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "rk4") && contains(refused.err, "ddpm")) << refused.err;
}

TEST_F(TraceTest, TheRegionFollowsTheNoisyPositionAndShrinksOnSchedule) {
  const json trace = predict("region", {"--flow-steps", "4"});
  ASSERT_EQ(trace["radius"]["kind"], "linear");
  const double r_0 = trace["radius"]["r_0"], r_min = trace["radius"]["r_min"];
  ASSERT_GT(r_0, r_min);
  const json& steps = trace["steps"];
  for (const json& step : steps) {
    EXPECT_NEAR(step["region"]["radius"], (1 - step["t"].get<double>()) * (r_0 - r_min) + r_min, 1e-12);
    EXPECT_EQ(step["region"]["center"], step["pose"]["position"]);
  }
  // Normalised and metric positions are one affine map apart: what two steps say of it holds for a third.
  for (std::size_t i = 0; i < 3; ++i) {
    const auto x = [&](std::size_t k) { return steps[k]["x"][i].get<double>(); };
    const auto meters = [&](std::size_t k) { return steps[k]["region"]["center"][i].get<double>(); };
    const double scale = (meters(4) - meters(0)) / (x(4) - x(0));
    EXPECT_NEAR(meters(2), meters(0) + scale * (x(2) - x(0)), 1e-9);
  }
}

TEST_F(TraceTest, TheErrorIsTheDistanceToTheExpertsKeyframe) {
  const json trace = predict("error");
  double square = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double d =
        trace["result"]["position"][i].get<double>() - trace["expert"]["position"][i].get<double>();
    square += d * d;
  }
  EXPECT_NEAR(trace["error"]["position_m"], std::sqrt(square), 1e-12);
  EXPECT_EQ(trace["error"]["open_correct"], trace["result"]["open"] == trace["expert"]["open"]);
  EXPECT_EQ(trace["scene"]["demo"], demo_);
  EXPECT_EQ(trace["scene"]["keyframe"], 1);
  EXPECT_EQ(trace["policy"]["generation"], 4);
}

TEST_F(TraceTest, MoreSamplesAreMoreTraces) {
  const json traces = predict("samples", {"--samples", "3"});
  ASSERT_EQ(traces.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(traces[i]["seed"], 11 + i);
  EXPECT_EQ(without_time(traces[0]), without_time(predict("one")));
}

TEST_F(TraceTest, ATraceFileBecomesAStripAndItsDemonstrationACloud) {
  predict("drawn");
  const auto strip = folder_->path() / "strip.png", cloud = folder_->path() / "cloud.ply";
  const Outcome drawn = run_command({"export", "strip", "--data", data(), "--trace",
                                     trace_file("drawn").string(), "--out", strip.string()});
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  std::ifstream png(strip, std::ios::binary);
  std::array<unsigned char, 24> header{};
  png.read(reinterpret_cast<char*>(header.data()), header.size());
  EXPECT_GT(header[18] << 8 | header[19], 5 * 480) << "five pictures side by side";

  const Outcome seen =
      run_command({"export", "cloud", "--data", data(), "--demo", demo_, "--out", cloud.string()});
  ASSERT_EQ(seen.code, 0) << seen.err;
  std::string word;
  std::ifstream ply(cloud, std::ios::binary);
  while (ply >> word && word != "vertex") {
  }
  int points = 0;
  ply >> points;
  EXPECT_GT(points, 10'000) << "four views of 128 x 128";

  const Outcome unknown = run_command(
      {"export", "cloud", "--data", data(), "--demo", demo_, "--out", (folder_->path() / "c.doc").string()});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(contains(unknown.err, "c.doc") && contains(unknown.err, ".ply")) << unknown.err;
}

TEST_F(TraceTest, AHalvedPolicyIsRefusedByName) {
  const auto half = folder_->path() / "half.flow";
  std::filesystem::copy_file(policy(), half);
  std::filesystem::resize_file(half, std::filesystem::file_size(half) / 2);
  const Outcome outcome =
      run_command({"predict", "--policy", half.string(), "--data", data(), "--demo", demo_, "--keyframe", "0",
                   "--trace", (folder_->path() / "no.json").string()});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, half.string())) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_->path() / "no.json"));
}

TEST_F(TraceTest, AWrongKeyframeOrDemonstrationIsAWrongCall) {
  const std::string trace = (folder_->path() / "no.json").string();
  const Outcome far = run_command({"predict", "--policy", policy(), "--data", data(), "--demo", demo_,
                                   "--keyframe", "99", "--trace", trace});
  EXPECT_EQ(far.code, 2);
  EXPECT_TRUE(contains(far.err, "99")) << far.err;
  const Outcome unknown = run_command({"predict", "--policy", policy(), "--data", data(), "--demo", "nosuch",
                                       "--keyframe", "0", "--trace", trace});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(contains(unknown.err, "nosuch")) << unknown.err;
}

}  // namespace
}  // namespace flowscope
