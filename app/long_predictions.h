// How much of the policy's time predictions may ask for.
#pragma once

#include <atomic>
#include <string>

#include "web/backend.h"

namespace flowscope {

/// Long predictions hold the thread of whoever asked for them: only so many at a time, so that a short one
/// always finds a place. Any thread.
class LongPredictions {
 public:
  static constexpr int long_steps = 100;  ///< flow steps of all samples together from which it counts as long
  static constexpr int most_at_once = 2;

  /// A place among the long ones while it lives; none is needed for a short one.
  class Place {
   public:
    /// Throws web::ApiError 429 when as many long ones are under way as may.
    Place(LongPredictions& all, int steps) : all_(steps < long_steps ? nullptr : &all) {
      if (!all_ || ++all_->running_ <= most_at_once) return;
      --all_->running_;
      throw web::ApiError(429, "busy",
                          std::to_string(most_at_once) +
                              " long predictions are under way already; try again " +
                              "when one has ended, or ask for fewer steps or samples");
    }
    ~Place() {
      if (all_) --all_->running_;
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    LongPredictions* all_;
  };

 private:
  std::atomic<int> running_{0};
};

}  // namespace flowscope
