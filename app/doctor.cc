#include "app/doctor.h"

#include <dlfcn.h>
#include <mujoco/mujoco.h>
#include <torch/csrc/api/include/torch/version.h>
#include <unistd.h>

#include <algorithm>
#include <boost/version.hpp>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <system_error>
#include <thread>

#include "app/doctor_limits.h"
#include "recorder/task.h"
#include "render/egl_device.h"
#include "render/renderer.h"

namespace flowscope::app {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::string gigabytes(double bytes) {
  std::ostringstream text;
  text.precision(1);
  text << std::fixed << bytes / 1e9 << " GB";
  return text.str();
}

/// The device that is taken, and all others with what renders on each.
DoctorCheck check_egl() {
  DoctorCheck check{"egl", true, "", ""};
  for (const EglDevice& device : egl_devices()) check.all.push_back(describe(device));
  try {
    const EglInfo info = probe_egl();
    check.found = info.platform + ": " + info.renderer + ", OpenGL " + info.version;
    if (info.renderer.find("llvmpipe") != std::string::npos) {
      check.advice = "drawn by the processor; with a GPU's driver and access to /dev/dri it is much faster";
    }
  } catch (const BadEglDevice& error) {
    check.ok = false;
    check.found = error.what();
    check.found.erase(std::min(check.found.find("; there are"), check.found.size()));
    check.advice = "choose one of these with --egl-device, or unset the variable";
  } catch (const std::system_error& error) {
    check.ok = false;
    check.found = error.what();
    check.advice = "see open files";
  } catch (const std::exception& error) {
    check.ok = false;
    check.found = error.what();
    check.found.erase(std::min(check.found.find("; tried:"), check.found.size()));
    check.advice = "apt-get install libegl1 libgl1-mesa-dri";
  }
  return check;
}

DoctorCheck check_simulator() {
  const bool same = mj_version() == mjVERSION_HEADER;
  return {
      "simulator", same, std::string("MuJoCo ") + mj_versionString(),
      same ? ""
           : "the program was built against another version: start it with ./flowscope, which rebuilds it"};
}

DoctorCheck check_libraries() {
  const std::string boost =
      std::to_string(BOOST_VERSION / 100000) + "." + std::to_string(BOOST_VERSION / 100 % 1000);
  return {"libraries", true, std::string("LibTorch ") + TORCH_VERSION + ", Boost " + boost, ""};
}

DoctorCheck check_assets() {
  try {
    const TaskLibrary library(find_assets());
    const std::size_t count = library.names().size();
    return {"assets", count > 0, find_assets().string() + ", " + std::to_string(count) + " tasks",
            count > 0 ? "" : "set FLOWSCOPE_ASSETS to the folder that holds robots/, scenes/ and tasks/"};
  } catch (const std::exception& error) {
    return {"assets", false, error.what(),
            "set FLOWSCOPE_ASSETS to the folder that holds robots/, scenes/ and tasks/"};
  }
}

DoctorCheck check_threads() {
  const std::string limit = environment("OMP_NUM_THREADS");
  const unsigned cores = std::thread::hardware_concurrency();
  return {"threads", cores > 0,
          std::to_string(cores) + " cores, OMP_NUM_THREADS " + (limit.empty() ? "not set" : limit),
          cores < 2 ? "simulation, rendering and training share one core: expect few frames a second" : ""};
}

bool processor_has(const std::string& feature) {
  std::ifstream stream("/proc/cpuinfo");
  for (std::string word; stream >> word;) {
    if (word == feature) return true;
  }
  return false;
}

/// OpenBLAS is asked at run time, since any BLAS may stand behind libblas.so.3.
template <typename Function>
Function* find_symbol(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_DEFAULT, name));
}

DoctorCheck check_blas() {
  auto* core_name = find_symbol<char*()>("openblas_get_corename");
  auto* parallel = find_symbol<int()>("openblas_get_parallel");
  if (core_name == nullptr || parallel == nullptr) {
    return {"blas", true, "not OpenBLAS",
            "apt-get install libopenblas0-openmp: training is several times faster"};
  }
  constexpr int openmp = 2;
  const std::string core = core_name();
  DoctorCheck check{"blas", true, "OpenBLAS for " + core, ""};
  if (parallel() != openmp) {
    check.found += ", with threads of its own";
    check.advice = "apt-get install libopenblas0-openmp: two thread pools take the cores from each other";
  } else if (processor_has("avx512f") && core != "SkylakeX" && core != "Cooperlake" &&
             core != "Sapphirerapids") {
    check.advice = "the processor has AVX-512: set OPENBLAS_CORETYPE=SKYLAKEX, or start with ./flowscope";
  }
  return check;
}

DoctorCheck check_ffmpeg() {
  std::istringstream folders(environment("PATH"));
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string program = folder + "/ffmpeg";
    if (::access(program.c_str(), X_OK) == 0) return {"ffmpeg", true, program, ""};
  }
  return {"ffmpeg", false, "not found", "apt-get install ffmpeg: MP4 export needs it"};
}

DoctorCheck check_memory() {
  std::ifstream stream("/proc/meminfo");
  for (std::string key; stream >> key;) {
    double kilobytes = 0;
    if (key == "MemAvailable:" && stream >> kilobytes) {
      const bool enough = kilobytes > 1e6;
      return {"memory", enough, gigabytes(kilobytes * 1024) + " available",
              enough ? "" : "close other programs: training needs about 1 GB"};
    }
  }
  return {"memory", true, "unknown", ""};
}

/// The folder itself, or the nearest one above it in which it could be made.
std::filesystem::path nearest_existing(const std::filesystem::path& folder) {
  std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  while (!std::filesystem::exists(path) && path.has_relative_path()) path = path.parent_path();
  return path;
}

DoctorCheck check_data(const std::filesystem::path& data) {
  const std::filesystem::path path = nearest_existing(data);
  const bool writable = std::filesystem::is_directory(path) && ::access(path.c_str(), W_OK | X_OK) == 0;
  const bool there = std::filesystem::exists(data);
  return {"data", writable,
          std::filesystem::absolute(data).lexically_normal().string() +
              (writable ? (there ? "" : ", to be made") : ", cannot be written"),
          writable ? ""
                   : "give a folder that you may write with --data, or change the owner of " + path.string()};
}

DoctorCheck check_disk(const std::filesystem::path& data) {
  std::error_code error;
  const auto space = std::filesystem::space(nearest_existing(data), error);
  if (error) return {"disk", false, error.message(), "give another folder with --data"};
  const bool enough = space.available > 1'000'000'000;
  return {"disk", enough, gigabytes(static_cast<double>(space.available)) + " free",
          enough ? "" : "delete what is not needed, or give a folder on another disk with --data"};
}

}  // namespace

std::vector<DoctorCheck> examine_machine(const DoctorCall& call) {
  return {check_egl(),           check_simulator(),     check_libraries(),
          check_assets(),        check_threads(),       check_blas(),
          check_memory(),        check_descriptors(),   check_ffmpeg(),
          check_data(call.data), check_disk(call.data), check_port(call.host, call.port, call.port_asked)};
}

}  // namespace flowscope::app
