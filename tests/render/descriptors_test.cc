#include "render/descriptors.h"

#include <gtest/gtest.h>

namespace flowscope {
namespace {

TEST(Descriptors, AreCountedAsFarAsTheLimitReaches) {
  const int before = descriptor_limit();
  EXPECT_EQ(spare_descriptors(8), 8);
  EXPECT_EQ(spare_descriptors(8), 8) << "counting uses none up";
  EXPECT_EQ(set_descriptor_limit(3), 3);
  EXPECT_EQ(spare_descriptors(8), 0);
  EXPECT_EQ(set_descriptor_limit(before), before);
  EXPECT_EQ(spare_descriptors(8), 8);
}

}  // namespace
}  // namespace flowscope
