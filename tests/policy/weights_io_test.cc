#include "policy/weights_io.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "policy/checkpoint.h"
#include "policy/safetensors.h"
#include "policy/sample.h"
#include "policy/trainer.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const Demo& demo() {
  static const Demo made = testing::toy_push_buttons(3);
  return made;
}

class WeightsExchange : public ::testing::Test {
 protected:
  void SetUp() override {
    TrainOptions options;
    options.preset = "nano";
    options.seed = 4;
    options.radius = "cosine";
    const auto trainer = Trainer::create(options);
    trainer->add(demo());
    for (int i = 0; i < 2; ++i) trainer->step();
    trainer->save(policy_);
  }
  FlowTrace prediction(const std::filesystem::path& file) const {
    PredictOptions options;
    options.seed = 11;
    return load_policy(file)->predict(input_of_keyframe(demo(), 1), options);
  }
  /// What import says of the exported file after `change`.
  template <typename Change>
  std::string complaint(Change&& change) const {
    TextByName metadata;
    TensorsByName tensors = read_safetensors(weights_, &metadata);
    auto config = nlohmann::ordered_json::parse(metadata.at("config"));
    change(tensors, metadata, config);
    if (metadata.contains("config")) metadata["config"] = config.dump();
    const auto changed = folder_.path() / "changed.safetensors";
    write_safetensors(changed, tensors, metadata);
    try {
      import_weights(changed, folder_.path() / "never.policy");
    } catch (const BadCheckpoint& error) {
      const std::string text = error.what();
      EXPECT_EQ(text.rfind(changed.string() + ": ", 0), 0u) << text;
      EXPECT_FALSE(std::filesystem::exists(folder_.path() / "never.policy"));
      return text;
    }
    return "";
  }

  const testing::TemporaryFolder folder_;
  const std::filesystem::path policy_ = folder_.path() / "a.policy",
                              weights_ = folder_.path() / "a.safetensors",
                              back_ = folder_.path() / "b.policy";
};

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
}

TEST_F(WeightsExchange, ARoundTripPredictsTheSameToTheBit) {
  export_weights(policy_, weights_);
  import_weights(weights_, back_);
  const FlowTrace a = prediction(policy_), b = prediction(back_);
  ASSERT_EQ(a.steps.size(), b.steps.size());
  for (std::size_t k = 0; k < a.steps.size(); ++k) {
    EXPECT_EQ(a.steps[k].x, b.steps[k].x) << k;
    EXPECT_EQ(a.steps[k].open_probability, b.steps[k].open_probability) << k;
    EXPECT_EQ(a.steps[k].region.radius_m, b.steps[k].region.radius_m) << k;
  }
  EXPECT_EQ(a.weights_sha256, b.weights_sha256);
  EXPECT_EQ(a.generation, b.generation);
}

TEST_F(WeightsExchange, ExportsTheMeanThatPredictsUnderTheNetworksNames) {
  export_weights(policy_, weights_);
  LoadedCheckpoint loaded = read_checkpoint(policy_);
  const TensorsByName written = read_safetensors(weights_);
  EXPECT_EQ(written.size(), loaded.model.network->named_parameters().size());
  const auto raw = loaded.model.network->named_parameters()["velocity.block0.A_log"].detach().clone();
  EXPECT_FALSE(torch::equal(written.at("velocity.block0.A_log"), raw)) << "these are not the mean";
  loaded.optimizer->swap_mean();
  for (const auto& item : loaded.model.network->named_parameters())
    EXPECT_TRUE(torch::equal(written.at(item.key()), item.value())) << item.key();
}

TEST_F(WeightsExchange, TrainsOnFromForeignWeights) {
  export_weights(policy_, weights_);
  import_weights(weights_, back_);
  const auto trainer = Trainer::resume(back_);
  trainer->add(demo());
  const TrainStatus now = trainer->step();
  EXPECT_EQ(now.step, 3);
  EXPECT_TRUE(std::isfinite(now.loss));
}

TEST_F(WeightsExchange, NamesEveryTensorThatDoesNotFit) {
  export_weights(policy_, weights_);
  const std::string text = complaint([](TensorsByName& tensors, auto&, auto&) {
    tensors.erase("velocity.block0.D");
    tensors["open.0.weight"] = torch::zeros({3, 5});
    tensors["extra"] = torch::zeros({1});
    tensors["pose.0.bias"] = torch::full_like(tensors["pose.0.bias"], NAN);
    tensors["time.0.bias"] = torch::zeros(tensors["time.0.bias"].sizes(), torch::kInt64);
  });
  expect_contains(text, "5 tensors do not fit:");
  expect_contains(text, "tensor velocity.block0.D [64] is missing");
  expect_contains(text, "tensor open.0.weight is [3, 5], not [32, 32]");
  expect_contains(text, "tensor extra belongs nowhere");
  expect_contains(text, "tensor pose.0.bias holds numbers that are not finite");
  expect_contains(text, "tensor time.0.bias holds no floating-point numbers");
}

TEST_F(WeightsExchange, NamesThePartOfTheConfigThatIsWrong) {
  export_weights(policy_, weights_);
  const auto of_config = [this](auto change) {
    return complaint([&](auto&, auto&, auto& config) { change(config); });
  };
  expect_contains(of_config([](auto& c) { c["shape"].erase("d_state"); }), "config shape.d_state is missing");
  expect_contains(of_config([](auto& c) { c["shape"]["heads"] = "six"; }), "config shape.heads: ");
  expect_contains(of_config([](auto& c) { c["shape"]["channels"] = 1 << 30; }),
                  "channels 1073741824 is not from");
  expect_contains(of_config([](auto& c) { c["policy"]["backbone"] = "lstm"; }), "backbone 'lstm'");
  expect_contains(of_config([](auto& c) { c["policy"]["preset"] = "huge"; }), "no policy preset 'huge'");
  expect_contains(of_config([](auto& c) { c["bounds"]["min"] = {0, 1}; }), "config bounds.min is not three");
  expect_contains(of_config([](auto& c) { c["words"] = std::vector<std::string>(300, "w"); }),
                  "config words");
  expect_contains(of_config([](auto& c) { c.erase("bounds"); }), "config: ");
  expect_contains(complaint([](auto&, auto& metadata, auto&) { metadata.erase("format"); }),
                  "\"format\" is not flowscope-weights/1");
  EXPECT_EQ(of_config([](auto& c) { c.erase("rates"); }), "")
      << "rates are the preset's where none are given";
}

}  // namespace
}  // namespace flowscope
