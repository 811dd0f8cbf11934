#include "render/strip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace flowscope {
namespace {

ImageRgb plain(int width, int height, std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  ImageRgb image(width, height);
  for (std::size_t i = 0; i < image.data.size(); i += 3) {
    image.data[i] = red;
    image.data[i + 1] = green;
    image.data[i + 2] = blue;
  }
  return image;
}

bool has_color(const ImageRgb& image, int x, int y, int red, int green, int blue) {
  const auto* p = image.at(x, y);
  return p[0] == red && p[1] == green && p[2] == blue;
}

TEST(Strip, PlacesPicturesSideBySide) {
  const ImageRgb strip =
      compose_strip({{plain(100, 100, 255, 0, 0), ""}, {plain(200, 100, 0, 0, 255), ""}}, {50, 10, 0});
  ASSERT_EQ(strip.width, 10 + 50 + 10 + 100 + 10);
  ASSERT_EQ(strip.height, 10 + 50 + 10);
  EXPECT_TRUE(has_color(strip, 5, 30, 255, 255, 255));
  EXPECT_TRUE(has_color(strip, 12, 12, 255, 0, 0));
  EXPECT_TRUE(has_color(strip, 57, 57, 255, 0, 0));
  EXPECT_TRUE(has_color(strip, 65, 30, 255, 255, 255));
  EXPECT_TRUE(has_color(strip, 72, 12, 0, 0, 255));
  EXPECT_TRUE(has_color(strip, 168, 58, 0, 0, 255));
}

TEST(Strip, WritesCaptionsBelow) {
  const StripStyle style{60, 10, 0};
  const ImageRgb strip = compose_strip({{plain(120, 60, 200, 200, 200), "t = 0.25"}}, style);
  int dark = 0;
  for (int y = 10 + 60; y < strip.height; ++y) {
    for (int x = 0; x < strip.width; ++x) dark += strip.at(x, y)[0] < 100;
  }
  EXPECT_GT(dark, 20);
}

TEST(Strip, BreaksIntoRows) {
  const std::vector<StripPanel> five(5, {plain(40, 40, 0, 255, 0), ""});
  const ImageRgb strip = compose_strip(five, {40, 0, 2});
  EXPECT_EQ(strip.width, 80);
  EXPECT_EQ(strip.height, 120);
  EXPECT_TRUE(has_color(strip, 20, 100, 0, 255, 0));
  EXPECT_TRUE(has_color(strip, 60, 100, 255, 255, 255));
}

TEST(Strip, RefusesWhatCannotBeShown) {
  EXPECT_THROW(compose_strip({}), std::invalid_argument);
  EXPECT_THROW(compose_strip({{ImageRgb(), "none"}}), std::invalid_argument);
  EXPECT_THROW(compose_strip({{plain(4, 4, 0, 0, 0), ""}}, {4, 0, 0}), std::invalid_argument);
  const std::vector<StripPanel> many(100, {plain(8, 4, 0, 0, 0), ""});
  EXPECT_THROW(compose_strip(many, {480, 0, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace flowscope
