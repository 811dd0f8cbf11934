#include "app/overlay_layers.h"

#include <gtest/gtest.h>

namespace flowscope {
namespace {

Overlay labelled(const std::string& text) {
  Overlay overlay;
  overlay.labels.push_back({{0, 0, 0}, text});
  return overlay;
}

TEST(OverlayLayers, KeepEachOthersThings) {
  OverlayLayers layers;
  layers.set("waypoints", labelled("1"));
  Overlay trace = labelled("t 0.50");
  trace.spheres.push_back({});
  layers.set("trace", trace);
  ASSERT_EQ(layers.all().labels.size(), 2u);
  EXPECT_EQ(layers.all().labels[0].text, "t 0.50") << "in the order of the names";
  EXPECT_EQ(layers.all().spheres.size(), 1u);

  layers.set("waypoints", labelled("2"));
  ASSERT_EQ(layers.all().labels.size(), 2u);
  EXPECT_EQ(layers.all().labels[1].text, "2");

  layers.set("trace", {});
  ASSERT_EQ(layers.all().labels.size(), 1u);
  EXPECT_TRUE(layers.all().spheres.empty());
}

}  // namespace
}  // namespace flowscope
