// Two demonstrations that are to be one and the same, place by place.
#pragma once

#include <gtest/gtest.h>

#include "recorder/demo_file.h"

namespace flowscope::testing {

inline void expect_same_pictures(const Observation& a, const Observation& b, const std::string& place) {
  ASSERT_EQ(a.views.size(), b.views.size()) << place;
  for (std::size_t v = 0; v < a.views.size(); ++v) {
    EXPECT_EQ(a.views[v].camera, b.views[v].camera) << place;
    EXPECT_EQ(a.views[v].rgb, b.views[v].rgb) << place << ", " << a.views[v].camera.name;
    EXPECT_EQ(a.views[v].depth, b.views[v].depth) << place << ", " << a.views[v].camera.name;
  }
}

/// Bit for bit, and as a file would have it.
inline void expect_same_demo(const Demo& a, const Demo& b) {
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i)
    EXPECT_EQ(a.frames[i].state, b.frames[i].state) << "frame " << i;
  expect_same_pictures(a.start, b.start, "start");
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  for (std::size_t k = 0; k < a.keyframes.size(); ++k) {
    EXPECT_EQ(a.keyframes[k].frame, b.keyframes[k].frame);
    EXPECT_EQ(a.keyframes[k].action, b.keyframes[k].action);
    expect_same_pictures(a.keyframes[k].observation, b.keyframes[k].observation,
                         "keyframe " + std::to_string(k));
  }
  EXPECT_EQ(encode_demo(a), encode_demo(b));
}

/// As it comes out of a store: depth in the file's steps.
inline Demo stored(const Demo& demo) { return decode_demo(encode_demo(demo), "stored.demo", DemoParts::all); }

}  // namespace flowscope::testing
