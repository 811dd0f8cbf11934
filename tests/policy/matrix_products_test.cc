// What is recorded is what was multiplied, forward and backward.
#include "policy/matrix_products.h"

#include <gtest/gtest.h>

#include "policy/torch_parts.h"

namespace flowscope {
namespace {

TEST(MatrixProducts, ALinearLayerMultipliesThreeTimes) {
  const torch::Tensor x = torch::randn({5, 3}).requires_grad_();
  torch::nn::Linear layer(3, 7);
  const auto products = record_products([&] { layer->forward(x).sum().backward(); });
  ASSERT_EQ(products.size(), 3u);
  for (const MatrixProduct& p : products) EXPECT_EQ(p.multiply_adds(), 5 * 3 * 7);
  EXPECT_EQ(products[0].left_size, (std::vector<std::int64_t>{5, 3}));
  EXPECT_EQ(products[0].right_size, (std::vector<std::int64_t>{3, 7}));
  EXPECT_EQ(products[0].right_stride, (std::vector<std::int64_t>{1, 3})) << "the weight lies transposed";
}

TEST(MatrixProducts, OthersWorkIsNotRecorded) {
  const torch::Tensor a = torch::randn({2, 4, 3}), b = torch::randn({2, 3, 6});
  const auto products = record_products([&] { torch::bmm(a, b) + 1; });
  torch::bmm(a, b);
  ASSERT_EQ(products.size(), 1u);
  EXPECT_EQ(products[0].multiply_adds(), 2 * 4 * 3 * 6);
  EXPECT_TRUE(record_products([&] { torch::relu(a); }).empty());
  EXPECT_THROW(record_products([] { throw std::runtime_error("stop"); }), std::runtime_error);
  EXPECT_EQ(record_products([&] { torch::bmm(a, b); }).size(), 1u) << "after what threw";
}

TEST(MatrixProducts, RunAgainAlone) {
  const torch::Tensor a = torch::randn({64, 96}), b = torch::randn({64, 80});
  const auto products = record_products([&] {
    for (int i = 0; i < 4; ++i) torch::mm(a.t(), b);
  });
  EXPECT_GT(products_ms(products, 2), 0);
  EXPECT_GT(products_ms(products, 2, 2), 0);
}

}  // namespace
}  // namespace flowscope
