#include "app/data_lock.h"

#include "recorder/atomic_file.h"

namespace flowscope::app {

FileLock lock_data(const std::filesystem::path& data, const std::string& command) {
  std::filesystem::create_directories(data);
  FileLock lock(data / ".flowscope-lock", "the data folder " + data.string(), "flowscope " + command);
  // Nobody else writes now, so no temporary can still be wanted.
  for (const char* folder : {"demos", "bin"}) {
    remove_stale_temporaries(data / folder, std::chrono::seconds(0));
  }
  // Here exports and trainings may write that hold no lock of this folder: only what is old is nobody's.
  for (const char* folder : {"traces", "exports", "policies"}) remove_stale_temporaries(data / folder);
  return lock;
}

FileLock lock_policy(const std::filesystem::path& policy, const std::string& command) {
  if (policy.has_parent_path()) std::filesystem::create_directories(policy.parent_path());
  const auto name = "." + policy.filename().string() + ".flowscope-lock";
  return {policy.parent_path() / name, "the policy " + policy.string(), "flowscope " + command};
}

}  // namespace flowscope::app
