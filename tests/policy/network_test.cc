// The network by itself: its token orders, and replicas that share its weights.
#include "policy/network.h"

#include <gtest/gtest.h>

#include "policy/replicas.h"
#include "tests/support/toy_scenes.h"

namespace flowscope {
namespace {

using testing::toy_shape;
using testing::ToyScenes;

TEST(TokenOrder, AStoredPrefixGivesWhatRunningItAgainGives) {
  NetworkShape shape = toy_shape();
  shape.stored_state = true;
  shape.fusion_blocks = shape.velocity_blocks = 2;
  const ToyScenes toy(shape, 2, 3);
  FlowRamNetwork network = toy.model.network;
  const torch::NoGradGuard no_grad;
  const NetworkOutput stored = toy.answer(network, 0, 2);
  network->compute_by(ScanPath::fused, true);
  const NetworkOutput again = toy.answer(network, 0, 2);
  EXPECT_TRUE(torch::equal(stored.action, again.action));
  EXPECT_TRUE(torch::equal(stored.open_logit, again.open_logit));
}

TEST(TokenOrder, TheActionSeesThePrefixInEveryOrder) {
  for (const auto& [paper, stored] : {std::pair{true, false}, {false, true}, {false, false}}) {
    NetworkShape shape = toy_shape();
    shape.paper_order = paper;
    shape.stored_state = stored;
    shape.grounded = false;  // whose heads would read the image tokens themselves
    shape.binding = false;
    const ToyScenes toy(shape, 1, 1);
    FlowRamNetwork network = toy.model.network;
    const NetworkOutput out = toy.answer(network, 0, 1);
    out.action.sum().backward();
    for (const char* name : {"word_table.weight", "patch.0.weight", "history.0.weight", "pose.0.weight"}) {
      const torch::Tensor gradient = network->named_parameters()[name].grad();
      ASSERT_TRUE(gradient.defined()) << name;
      EXPECT_GT(gradient.abs().max().item<float>(), 0) << name
                                                       << (paper    ? " paper"
                                                           : stored ? " stored"
                                                                    : " carried");
    }
  }
}

TEST(Grounding, WeighsTheCentresOfGroupsWhereThePointEncoderMakesGroups) {
  NetworkShape shape = toy_shape();
  shape.point_groups = 6;
  shape.group_size = 4;
  const ToyScenes toy(shape, 2, 2);
  FlowRamNetwork network = toy.model.network;
  const NetworkOutput out = toy.answer(network, 0, 2);
  ASSERT_EQ(out.weights.size(1), 2 * 6 + shape.image_tokens + history_length);
  ASSERT_EQ(out.weight_position.size(1), out.weights.size(1));
  EXPECT_LT((out.weights.sum(1) - 1).abs().max().item<float>(), 1e-5f);
  out.action.sum().backward();
  EXPECT_GT(network->named_parameters()["region_tokens.in.weight"].grad().abs().max().item<float>(), 0);
}

TEST(Replicas, GiveTheGradientsOfOneNetworkWithTheWholeBatch) {
  const ToyScenes toy(toy_shape(), 4, 2);
  FlowRamNetwork network = toy.model.network;
  const auto loss_of = [&](FlowRamNetwork& n, std::size_t first, std::size_t count) {
    const NetworkOutput out = toy.answer(n, first, count);
    return out.action.square().sum() + out.open_logit.square().sum();
  };
  loss_of(network, 0, 4).backward();
  std::map<std::string, torch::Tensor> whole;
  for (auto& item : network->named_parameters()) {
    if (item.value().grad().defined()) whole[item.key()] = item.value().grad().clone();
    item.value().mutable_grad().reset();
  }
  Replicas replicas(network, toy.model.shape, "mamba", 2);
  std::vector<torch::Tensor> first_run;
  for (const int threads : {1, 2}) {
    replicas.run(threads, [&](int part, FlowRamNetwork& n) {
      loss_of(n, 2 * static_cast<std::size_t>(part), 2).backward();
    });
    std::vector<torch::Tensor> gradients;
    for (auto& item : network->named_parameters()) {
      if (whole.count(item.key()) == 0) continue;
      const torch::Tensor& w = whole[item.key()];
      EXPECT_LT((item.value().grad() - w).abs().max().item<float>(),
                1e-4f * (1 + w.abs().max().item<float>()))
          << item.key();
      gradients.push_back(item.value().grad().clone());
      item.value().mutable_grad().reset();
    }
    if (first_run.empty()) first_run = gradients;
    for (std::size_t i = 0; i < gradients.size(); ++i) EXPECT_TRUE(torch::equal(gradients[i], first_run[i]));
  }
}

TEST(Replicas, ReadTheWeightsThatAreChangedInPlaceAndPassOnWhatAPartThrows) {
  const ToyScenes toy(toy_shape(), 2, 1);
  FlowRamNetwork network = toy.model.network;
  Replicas replicas(network, toy.model.shape, "mamba", 2);
  {
    const torch::NoGradGuard no_grad;
    for (auto& p : network->parameters()) p.mul_(0.5);
  }
  torch::Tensor answers[2];
  replicas.run(2, [&](int part, FlowRamNetwork& n) {
    const torch::NoGradGuard no_grad;
    answers[part] = toy.answer(n, 0, 1).action;
  });
  EXPECT_TRUE(torch::equal(answers[0], answers[1]));
  EXPECT_THROW(replicas.run(2,
                            [](int part, FlowRamNetwork&) {
                              if (part == 1) throw std::runtime_error("a part failed");
                            }),
               std::runtime_error);
}

}  // namespace
}  // namespace flowscope
