// What this machine offers to flowscope, what it lacks, and how to mend it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace flowscope::app {

struct DoctorCheck {
  std::string name;
  bool ok = true;      ///< false: something will not work
  std::string found;   ///< what is there
  std::string advice;  ///< what to do; may also come with an ok check that could be better
};

/// Opens an EGL context for a moment; writes nothing. `data` is the --data folder, which need not exist.
std::vector<DoctorCheck> examine_machine(const std::filesystem::path& data);

}  // namespace flowscope::app
