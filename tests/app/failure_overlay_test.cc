// A failed move is drawn where it was to go, with its reason, until the next run or reset.
#include "app/failure_overlay.h"

#include <gtest/gtest.h>

#include <thread>

#include "app/studio.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

TEST(FailureOverlay, ShowsTheWantedPoseInRedWithTheReasonInShortLines) {
  const Pose wanted{{0.3, 0.1, 1.0}, Eigen::Quaterniond(0, 1, 0, 0)};
  const Overlay overlay = overlay_of_failure(
      wanted, "waypoint 2 (line 4): unreachable: it is out of the arm's reach or joint limits");
  ASSERT_EQ(overlay.ghosts.size(), 1u);
  EXPECT_EQ(overlay.ghosts[0].world_from_tool, wanted);
  EXPECT_EQ(overlay.ghosts[0].color[0], palette::failure[0]);
  EXPECT_EQ(overlay.frames.size(), 1u);
  ASSERT_EQ(overlay.labels.size(), 1u);
  EXPECT_EQ(overlay.labels[0].text,
            "waypoint 2 (line 4): unreachable: it is out\nof the arm's reach or joint limits");
}

class StudioFailure : public ::testing::Test {
 protected:
  StudioFailure() {
    StudioOptions options;
    options.assets = FLOWSCOPE_SOURCE_DIR "/assets";
    options.data = folder_.path() / "data";
    studio_ = std::make_unique<Studio>(options);
    studio_->reset("push_buttons", 0, 1);
  }
  std::vector<std::uint8_t> picture() { return studio_->snapshot({"main", "png", 320, 240}); }
  std::string run(const std::string& position) {
    const std::string id = studio_->run_script(
        {"steps:\n  - move: {frame: world, position: " + position + ", rpy_deg: [180, 0, 0]}\n", "", false});
    for (;;) {
      const web::JobStatus job = studio_->job(id);
      if (job.state != "queued" && job.state != "running") return job.message;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  const testing::TemporaryFolder folder_;
  std::unique_ptr<Studio> studio_;
};

TEST_F(StudioFailure, DrawsAnUnreachableAndACollidingPoseUntilTheNextRunOrReset) {
  const auto before = picture();
  EXPECT_NE(run("[0.5, 0.2, 1.6]").find("unreachable"), std::string::npos);
  const auto unreachable = picture();
  EXPECT_NE(unreachable, before);
  EXPECT_NE(run("[0.3, -0.3, 0.76]").find("in_collision"), std::string::npos);
  EXPECT_NE(picture(), before);
  EXPECT_NE(picture(), unreachable);
  studio_->reset("push_buttons", 0, 1);
  EXPECT_EQ(picture(), before);
}

}  // namespace
}  // namespace flowscope
