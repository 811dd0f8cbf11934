#include "render/depth_png.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

namespace flowscope {
namespace {

TEST(DepthPng, HoldsMillimetresAndKeepsNoHitApart) {
  DepthImage depth(3, 2);
  depth.data = {0.0f, 0.0004f, 1.2345f, 0.9996f, 65.535f, 99.0f};
  const cv::Mat read = cv::imdecode(encode_depth_png(depth), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.type(), CV_16UC1);
  ASSERT_EQ(read.cols, 3);
  const std::vector<std::uint16_t> values(read.begin<std::uint16_t>(), read.end<std::uint16_t>());
  EXPECT_EQ(values[0], 0);
  EXPECT_EQ(values[1], 0);
  EXPECT_NEAR(values[2], 1234.5, 0.6);
  EXPECT_EQ(values[3], 1000);
  EXPECT_EQ(values[4], 65535);
  EXPECT_EQ(values[5], 65535);
}

TEST(DepthPng, AnEmptyPictureIsRefused) {
  EXPECT_THROW(encode_depth_png(DepthImage()), std::invalid_argument);
  DepthImage torn(4, 4);
  torn.data.pop_back();
  EXPECT_THROW(encode_depth_png(torn), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
