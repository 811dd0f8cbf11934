// The newest picture of each view, and who wants it. I/O thread only.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "web/frame.h"

namespace flowscope::web {

class FrameViewer {
 public:
  virtual ~FrameViewer() = default;
  virtual void offer(const FramePtr& frame) = 0;  ///< must not leave the hub from inside
  virtual void close() = 0;
};

class FrameHub {
 public:
  using ViewersChanged = std::function<void(const std::string& view, int viewers)>;
  explicit FrameHub(ViewersChanged viewers_changed) : viewers_changed_(std::move(viewers_changed)) {}

  /// The viewer gets the newest picture at once, if there is one.
  void join(const std::string& view, const std::shared_ptr<FrameViewer>& viewer);
  void leave(const std::string& view, const std::shared_ptr<FrameViewer>& viewer);
  void publish(const std::string& view, const FramePtr& frame);
  void close_all();

 private:
  struct Slot {
    FramePtr newest;
    std::set<std::shared_ptr<FrameViewer>> viewers;
  };
  ViewersChanged viewers_changed_;
  std::map<std::string, Slot> views_;
};

}  // namespace flowscope::web
