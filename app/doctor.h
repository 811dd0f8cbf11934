// What this machine offers to flowscope, what it lacks, and how to mend it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace flowscope::app {

struct DoctorCheck {
  std::string name;
  bool ok = true;                  ///< false: something will not work
  std::string found;               ///< what is there
  std::string advice;              ///< what to do; may also come with an ok check that could be better
  std::vector<std::string> all{};  ///< of EGL: each device and what renders on it
};

/// What `serve` would be called with.
struct DoctorCall {
  std::filesystem::path data;  ///< need not exist
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080;
  bool port_asked = false;  ///< the user named it: it has to be free
};

/// Opens EGL contexts and a port for a moment; writes nothing.
std::vector<DoctorCheck> examine_machine(const DoctorCall& call);

}  // namespace flowscope::app
