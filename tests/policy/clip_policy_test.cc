// A policy that reads with CLIP: small frozen encoders inside the whole network.
#include <gtest/gtest.h>

#include <cstdlib>

#include "policy/clip/phrases.h"
#include "policy/integrate.h"
#include "policy/sample.h"
#include "tests/support/clip_weights.h"
#include "tests/support/synthetic_demo.h"

namespace flowscope {
namespace {

NetworkShape clip_shape() {
  NetworkShape shape = load_preset("nano").shape;
  shape.image_branch = shape.text_branch = "clip";
  return shape;
}

std::shared_ptr<const ClipEncoders> small_encoders() {
  auto encoders = std::make_shared<ClipEncoders>();
  encoders->image = std::make_shared<ClipResNet>(testing::random_weights(
      testing::trunk_shapes(
          {.stem = 4, .stem_out = 8, .narrow = {4, 4, 4, 4}, .blocks = {1, 1, 1, 1}, .expansion = 2}),
      1));
  encoders->text =
      std::make_shared<ClipTextEncoder>(testing::random_weights(testing::text_shapes(512, 1, 516), 2));
  encoders->tokenizer = std::make_shared<ClipTokenizer>("r e\nre d</w>\n");
  return encoders;
}

struct Seen {
  Model model;
  Demo demo = testing::toy_push_buttons(3);

  Seen() : model(make_model(clip_shape(), RadiusSchedule{}, "mamba", "cfm", 5, small_encoders())) {
    model.bounds = demo.bounds;
    model.scale = PositionScale::from_bounds(demo.bounds);
  }
  SceneInput prepare(const PolicyInput& input) const {
    return prepare_input(input, model.bounds, model.shape, model.vocabulary);
  }
};

TEST(ClipPolicy, SeesPicturesAndWords) {
  Seen seen;
  const PolicyInput input = input_of_keyframe(seen.demo, 0);
  const Vector9 before = integrate_flow(seen.model, seen.prepare(input), {}).steps[1].velocity;
  EXPECT_EQ(integrate_flow(seen.model, seen.prepare(input), {}).steps[1].velocity, before);
  PolicyInput other = input;
  other.instruction = "now " + other.instruction;  // what is too long loses its end
  EXPECT_NE(integrate_flow(seen.model, seen.prepare(other), {}).steps[1].velocity, before);
  // The pictures alone, not the colours of the points.
  SceneInput painted = seen.prepare(input);
  auto scene = std::make_shared<PreparedScene>(*painted.scene);
  auto pictures = std::make_shared<std::vector<ImageRgb>>(*scene->pictures);
  for (auto& v : pictures->front().data) v = static_cast<std::uint8_t>(255 - v);
  scene->pictures = pictures;
  painted.scene = scene;
  EXPECT_NE(integrate_flow(seen.model, painted, {}).steps[1].velocity, before);
}

TEST(ClipPolicy, LearnsThePyramidAndTheProjectionAndNothingThatIsFrozen) {
  Seen seen;
  const SceneInput input = seen.prepare(input_of_keyframe(seen.demo, 0));
  const SceneMemory memory =
      seen.model.network->encode(make_scene_batch({&input}, seen.model.shape, seen.model.scale));
  (memory.image.sum() + memory.words.sum()).backward();
  bool pyramid = false;
  for (const auto& item : seen.model.network->named_parameters()) {
    EXPECT_EQ(item.key().find("visual."), std::string::npos) << item.key();
    if (item.key().starts_with("clip_image.") && item.value().grad().defined())
      pyramid = pyramid || item.value().grad().abs().max().item<float>() > 0;
  }
  EXPECT_TRUE(pyramid);
  EXPECT_GT(seen.model.network->named_parameters()["word_feature.weight"].grad().abs().max().item<float>(),
            0);
}

TEST(ClipPolicy, BindsTheTokensOfAColourWordToItsColour) {
  const ClipPhrases phrases(small_encoders());
  const auto words = phrases.encode("push the red", 53);
  ASSERT_GE(words.size(), 3u);
  int red = 0;
  for (const Word& w : words) {
    EXPECT_EQ(w.feature->size(), 512u);
    if (w.row == Vocabulary::color) {
      ++red;
      EXPECT_EQ(w.color, Eigen::Vector3f(1, 0, 0));
      EXPECT_EQ(w.mention, 1);
    }
  }
  EXPECT_EQ(red, 1) << "one token: the merges make a whole word of it";
}

TEST(ClipPolicy, SaysWhatIsMissing) {
  unsetenv("FLOWSCOPE_CLIP");
  EXPECT_THROW(clip_for(clip_shape(), ""), std::invalid_argument);
  EXPECT_EQ(clip_for(load_preset("nano").shape, "no file"), nullptr);
  EXPECT_THROW(make_model(clip_shape(), RadiusSchedule{}, "mamba", "cfm", 0), std::invalid_argument);
  NetworkShape shape = clip_shape();
  shape.text_branch = "words";
  auto no_pictures = std::make_shared<ClipEncoders>();
  EXPECT_THROW(make_model(shape, RadiusSchedule{}, "mamba", "cfm", 0, no_pictures), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
