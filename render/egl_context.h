// An off-screen OpenGL context. Its source is the only file that includes EGL headers.
#pragma once

#include <thread>

#include "render/renderer.h"

namespace flowscope {

/// Desktop OpenGL without a window or a surface: the caller draws into framebuffer objects. The device that
/// the environment chooses (egl_device.h), else the first that works of: every EGL device, Mesa's surfaceless
/// platform, the default display. Created, used and destroyed on one thread; several contexts may live on one
/// thread, each user calls make_current() first.
class EglContext {
 public:
  /// Leaves the new context current. Throws BadEglDevice, std::system_error when no file descriptor is left,
  /// or std::runtime_error that lists what was tried and why it failed.
  EglContext();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Throws std::logic_error on a thread other than the one that made the context.
  void make_current();
  bool on_owner_thread() const { return std::this_thread::get_id() == owner_; }
  const EglInfo& info() const { return info_; }

 private:
  std::thread::id owner_ = std::this_thread::get_id();
  void* display_ = nullptr;
  void* context_ = nullptr;
  EglInfo info_;
};

}  // namespace flowscope
