#include "policy/mamba.h"

#include <gtest/gtest.h>

namespace flowscope {
namespace {

TEST(MambaBlock, KeepsTheShapeAndIsCausal) {
  torch::manual_seed(1);
  MambaBlock block(MambaOptions{.d_model = 24, .d_state = 4});
  const torch::NoGradGuard no_grad;
  torch::Tensor x = torch::randn({2, 9, 24});
  const torch::Tensor before = block->forward(x);
  ASSERT_EQ(before.sizes(), x.sizes());
  x.select(1, 5).add_(torch::randn({2, 24}));
  const torch::Tensor after = block->forward(x);
  EXPECT_TRUE(torch::equal(before.narrow(1, 0, 5), after.narrow(1, 0, 5)));
  EXPECT_GT((before.select(1, 6) - after.select(1, 6)).abs().max().item<float>(), 1e-6);
}

}  // namespace
}  // namespace flowscope
