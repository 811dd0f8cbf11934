// Which EGL device draws, and which there are.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace flowscope {

/// The environment names a device that is not there. what() names the variable and lists the devices.
class BadEglDevice : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// The variable of --egl-device. Further ones, after it: MUJOCO_EGL_DEVICE_ID, EGL_DEVICE_ID.
inline constexpr const char* egl_device_variable = "FLOWSCOPE_EGL_DEVICE";

/// The number of the device that the environment asks for, in EGL's own order from 0; none where no variable
/// is set (or only to nothing): then the first that can draw is taken. Throws BadEglDevice.
std::optional<int> chosen_egl_device();

/// One way to a picture.
struct EglDevice {
  std::string name;      ///< "device 0", "surfaceless", "default display"
  std::string renderer;  ///< who draws there, with the version of OpenGL; empty: nobody
  std::string problem;   ///< why nobody
};

/// All that EglContext would try, in its order. Opens each for a moment on a thread of its own. Never throws
/// because of a device.
std::vector<EglDevice> egl_devices();
/// A line for each: "device 0: llvmpipe …, OpenGL 4.5".
std::string describe(const EglDevice& device);

}  // namespace flowscope
