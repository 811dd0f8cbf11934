#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "policy/bench_infer.h"
#include "policy/bench_tokens.h"

namespace flowscope {
namespace {

std::map<std::string, BenchResult> by_name(const std::vector<BenchResult>& results) {
  std::map<std::string, BenchResult> map;
  for (const BenchResult& r : results) {
    EXPECT_TRUE(std::isfinite(r.value) && r.value > 0) << r.name;
    map[r.name] = r;
  }
  EXPECT_EQ(map.size(), results.size()) << "a name is given twice";
  return map;
}

TEST(Bench, MeasuresAPredictionEveryWay) {
  auto results = by_name(bench_infer({.preset = "nano", .flow_steps = 2, .repeats = 1}));
  for (const char* name :
       {"infer_2_steps", "infer_products", "infer_over_products", "infer_operators", "infer_full_evaluation",
        "infer_further_step", "predict_2_steps", "predict_1_step", "predict_further_step", "infer_plain"}) {
    EXPECT_EQ(results.count(name), 1u) << name;
  }
  EXPECT_NEAR(results["infer_over_products"].value,
              results["infer_2_steps"].value / results["infer_products"].value, 1e-9);
}

TEST(Bench, FitsALineThroughTheTimes) {
  auto results = by_name(bench_tokens({.tokens = {32, 64, 128}, .channels = 16, .d_state = 4, .repeats = 1}));
  for (const char* name : {"mamba_32_tokens", "mamba_off_line", "transformer_128_tokens"}) {
    EXPECT_EQ(results.count(name), 1u) << name;
  }
}

}  // namespace
}  // namespace flowscope
