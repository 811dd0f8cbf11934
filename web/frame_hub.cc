#include "web/frame_hub.h"

namespace flowscope::web {

void FrameHub::join(const std::string& view, const std::shared_ptr<FrameViewer>& viewer) {
  Slot& slot = views_[view];
  if (!slot.viewers.insert(viewer).second) return;
  viewers_changed_(view, static_cast<int>(slot.viewers.size()));
  if (slot.newest) viewer->offer(slot.newest);
}

void FrameHub::leave(const std::string& view, const std::shared_ptr<FrameViewer>& viewer) {
  Slot& slot = views_[view];
  if (slot.viewers.erase(viewer) == 0) return;
  viewers_changed_(view, static_cast<int>(slot.viewers.size()));
}

void FrameHub::publish(const std::string& view, const FramePtr& frame) {
  Slot& slot = views_[view];
  slot.newest = frame;
  for (const auto& viewer : slot.viewers) viewer->offer(frame);
}

void FrameHub::close_all() {
  for (auto& [name, slot] : views_) {
    const auto viewers = slot.viewers;  // closing leaves
    for (const auto& viewer : viewers) viewer->close();
  }
}

}  // namespace flowscope::web
