#include "render/egl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <vector>

#include "render/descriptors.h"

namespace flowscope {

namespace {

struct Candidate {
  std::string platform;
  EGLDisplay display = EGL_NO_DISPLAY;
};

struct OpenContext {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  EglInfo info;
};

std::string egl_error() {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "EGL error 0x%04x", static_cast<unsigned>(eglGetError()));
  return text.data();
}

template <typename Function>
Function load(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

bool client_has(const char* extension) {
  const char* all = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  return all != nullptr && std::strstr(all, extension) != nullptr;
}

std::vector<Candidate> candidates() {
  std::vector<Candidate> found;
  const auto platform_display = load<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  const auto query_devices = load<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  if (platform_display != nullptr && query_devices != nullptr && client_has("EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 32> devices{};
    EGLint count = 0;
    if (query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE) {
      for (EGLint i = 0; i < count; ++i) {
        found.push_back(
            {"device " + std::to_string(i),
             platform_display(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr)});
      }
    }
  }
  if (platform_display != nullptr && client_has("EGL_MESA_platform_surfaceless")) {
    found.push_back(
        {"surfaceless", platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)});
  }
  found.push_back({"default display", eglGetDisplay(EGL_DEFAULT_DISPLAY)});
  return found;
}

std::string gl_string(unsigned name) {
  using GetString = const unsigned char* (*)(unsigned);
  static const auto get_string = load<GetString>("glGetString");
  const unsigned char* text = get_string == nullptr ? nullptr : get_string(name);
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

/// Why this candidate cannot be used; empty when `out` is open and current.
std::string open(const Candidate& candidate, OpenContext& out) {
  if (candidate.display == EGL_NO_DISPLAY) return "no display";
  if (eglInitialize(candidate.display, nullptr, nullptr) != EGL_TRUE) return "eglInitialize: " + egl_error();
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return "no desktop OpenGL: " + egl_error();
  constexpr std::array<EGLint, 11> wanted{EGL_RED_SIZE,
                                          8,
                                          EGL_GREEN_SIZE,
                                          8,
                                          EGL_BLUE_SIZE,
                                          8,
                                          EGL_SURFACE_TYPE,
                                          EGL_PBUFFER_BIT,
                                          EGL_RENDERABLE_TYPE,
                                          EGL_OPENGL_BIT,
                                          EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(candidate.display, wanted.data(), &config, 1, &count) != EGL_TRUE || count == 0) {
    return "no RGB8 OpenGL configuration";
  }
  const EGLContext context = eglCreateContext(candidate.display, config, EGL_NO_CONTEXT, nullptr);
  if (context == EGL_NO_CONTEXT) return "eglCreateContext: " + egl_error();
  if (eglMakeCurrent(candidate.display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) {
    const std::string why = "eglMakeCurrent: " + egl_error();
    eglDestroyContext(candidate.display, context);
    return why;
  }
  constexpr unsigned gl_vendor = 0x1F00, gl_renderer = 0x1F01, gl_version = 0x1F02;
  out = {candidate.display,
         context,
         {candidate.platform, gl_string(gl_renderer), gl_string(gl_vendor), gl_string(gl_version)}};
  return {};
}

constexpr int descriptors_of_a_driver = 32;

OpenContext open_first() {
  std::string tried;
  for (const Candidate& candidate : candidates()) {
    OpenContext opened;
    const std::string problem = open(candidate, opened);
    if (problem.empty()) return opened;
    tried += "\n  " + candidate.platform + ": " + problem;
  }
  // A driver opens dozens of files, and what it says when it cannot sounds like a missing device.
  if (spare_descriptors(descriptors_of_a_driver) < descriptors_of_a_driver) {
    throw std::runtime_error(
        "too few file descriptors to open a graphics device: " + std::to_string(descriptor_limit()) +
        " are allowed (ulimit -n 1024 allows more)");
  }
  throw std::runtime_error(
      "no EGL device can draw (install libegl1 and libgl1-mesa-dri, or a GPU driver); tried:" + tried);
}

}  // namespace

EglContext::EglContext() {
  OpenContext opened = open_first();
  display_ = opened.display;
  context_ = opened.context;
  info_ = std::move(opened.info);
}

EglContext::~EglContext() {
  if (!on_owner_thread()) {
    std::fputs("flowscope: an EGL context was destroyed on a foreign thread\n", stderr);
    std::terminate();
  }
  if (eglGetCurrentContext() == context_)
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  // No eglTerminate: the display belongs to the process, and other threads may have contexts on it.
}

void EglContext::make_current() {
  if (!on_owner_thread()) throw std::logic_error("a renderer was used on a thread that did not create it");
  if (eglGetCurrentContext() == context_) return;
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE) {
    throw std::runtime_error("eglMakeCurrent: " + egl_error());
  }
}

EglInfo probe_egl() {
  EglInfo info;
  std::exception_ptr failure;
  std::jthread([&] {
    try {
      info = EglContext().info();
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
  return info;
}

}  // namespace flowscope
