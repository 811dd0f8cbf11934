// The traces of a data folder: in memory as made, on disk as the contract's JSON.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "policy/policy.h"
#include "render/scene_state.h"
#include "web/backend.h"

namespace flowscope {

/// A trace together with the scene it was made in, which drawing and branching need.
struct StoredTrace {
  FlowTrace trace;
  SceneState state;
  PolicyInput input;
  std::uint64_t episode = 0;
};

/// Any thread.
class TraceStore {
 public:
  explicit TraceStore(std::filesystem::path folder);
  /// Gives the trace an id and a date, writes <id>.json atomically, keeps it in memory.
  std::string add(StoredTrace trace);
  /// Throws web::ApiError 404.
  std::shared_ptr<const StoredTrace> get(const std::string& id) const;
  std::vector<web::TraceEntry> list() const;
  void remove(const std::string& id);

 private:
  const std::filesystem::path folder_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const StoredTrace>> traces_;  // ids sort by age
  int next_ = 1;
};

web::TraceEntry entry_of(const FlowTrace& trace);
/// Writes the contract's trace document (an array when there are several). Throws std::system_error naming
/// the file.
void write_trace_file(const std::filesystem::path& file, const std::vector<FlowTrace>& traces);

}  // namespace flowscope
