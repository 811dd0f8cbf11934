#include "render/egl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include "render/descriptors.h"
#include "render/egl_device.h"

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

std::vector<EGLDeviceEXT> devices() {
  const auto query_devices = load<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  std::array<EGLDeviceEXT, 32> found{};
  EGLint count = 0;
  if (query_devices == nullptr || !client_has("EGL_EXT_platform_device") ||
      query_devices(static_cast<EGLint>(found.size()), found.data(), &count) != EGL_TRUE) {
    return {};
  }
  return {found.begin(), found.begin() + count};
}

std::vector<Candidate> candidates() {
  std::vector<Candidate> found;
  const auto platform_display = load<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (platform_display != nullptr) {
    for (const EGLDeviceEXT device : devices()) {
      found.push_back({"device " + std::to_string(found.size()),
                       platform_display(EGL_PLATFORM_DEVICE_EXT, device, nullptr)});
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

OpenContext open_chosen_or_first() {
  std::vector<Candidate> all = candidates();
  const std::optional<int> chosen = chosen_egl_device();
  if (chosen) all = {all.at(static_cast<std::size_t>(*chosen))};  // devices come first
  std::string tried;
  for (const Candidate& candidate : all) {
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
      (chosen ? "the chosen EGL device cannot draw (flowscope doctor lists all)"
              : "no EGL device can draw (install libegl1 and libgl1-mesa-dri, or a GPU driver)") +
      std::string("; tried:") + tried);
}

void on_a_thread_of_its_own(const std::function<void()>& work) {
  std::exception_ptr failure;
  std::jthread([&] {
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
}

std::string list_of_devices() {
  std::string list;
  for (const EglDevice& device : egl_devices()) {
    if (device.name.starts_with("device ")) list += "\n  " + describe(device);
  }
  return list.empty() ? " none" : list;
}

}  // namespace

std::optional<int> chosen_egl_device() {
  for (const char* variable : {egl_device_variable, "MUJOCO_EGL_DEVICE_ID", "EGL_DEVICE_ID"}) {
    const char* value = std::getenv(variable);
    if (value == nullptr || *value == '\0') continue;
    const std::string_view text = value;
    int number = -1;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const auto count = static_cast<int>(devices().size());
    if (error == std::errc() && end == text.data() + text.size() && number >= 0 && number < count)
      return number;
    throw BadEglDevice("EGL device '" + std::string(text.substr(0, 40)) + "' (" + variable +
                       ") is not there; there are:" + list_of_devices());
  }
  return std::nullopt;
}

std::vector<EglDevice> egl_devices() {
  std::vector<EglDevice> list;
  for (const Candidate& candidate : candidates()) {
    on_a_thread_of_its_own([&] {
      OpenContext opened;
      const std::string problem = open(candidate, opened);
      list.push_back({candidate.platform, "", problem});
      if (!problem.empty()) return;
      list.back().renderer = opened.info.renderer + ", OpenGL " + opened.info.version;
      eglMakeCurrent(opened.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      eglDestroyContext(opened.display, opened.context);
    });
  }
  return list;
}

std::string describe(const EglDevice& device) {
  return device.name + ": " + (device.problem.empty() ? device.renderer : "cannot draw: " + device.problem);
}

EglContext::EglContext() {
  OpenContext opened = open_chosen_or_first();
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
  on_a_thread_of_its_own([&] { info = EglContext().info(); });
  return info;
}

}  // namespace flowscope
