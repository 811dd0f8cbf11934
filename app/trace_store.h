// The traces of a data folder: on disk as the contract's JSON; with all that drawing and branching need, the
// newest in memory and the others on a shelf.
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/trace_shelf.h"
#include "web/backend.h"

namespace flowscope {

/// Any thread.
class TraceStore {
 public:
  static constexpr std::size_t newest_in_memory = 8;

  explicit TraceStore(std::filesystem::path folder);
  /// Gives the trace an id and a date, writes <id>.json atomically, keeps it.
  std::string add(StoredTrace trace);
  /// Throws web::ApiError 404.
  std::shared_ptr<const StoredTrace> get(const std::string& id) const;
  std::vector<web::TraceEntry> list() const;
  void remove(const std::string& id);

 private:
  struct Kept {
    web::TraceEntry entry;
    std::shared_ptr<const StoredTrace> whole;  ///< null: on the shelf
    TraceShelf::Place place = {};
  };
  /// Puts what is not among the newest on the shelf; what finds no room there stays.
  void shelve_older();

  const std::filesystem::path folder_;
  mutable std::mutex mutex_;
  TraceShelf shelf_;
  std::map<std::string, Kept> traces_;
  std::deque<std::string> in_memory_;  ///< the oldest first
  int next_ = 1;
};

web::TraceEntry entry_of(const FlowTrace& trace);
/// Writes the contract's trace document (an array when there are several). Throws std::system_error naming
/// the file.
void write_trace_file(const std::filesystem::path& file, const std::vector<FlowTrace>& traces);

}  // namespace flowscope
