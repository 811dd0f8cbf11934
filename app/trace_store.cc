#include "app/trace_store.h"

#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>

#include "recorder/atomic_file.h"
#include "recorder/utc_time.h"
#include "web/wire.h"

namespace flowscope {

using web::ApiError;
using web::TraceEntry;

void write_trace_file(const std::filesystem::path& file, const std::vector<FlowTrace>& traces) {
  web::wire::Json document = web::wire::Json::array();
  for (const auto& trace : traces) document.push_back(web::wire::to_json(trace));
  const std::string text = web::wire::dump(traces.size() == 1 ? document[0] : document, 1) + "\n";
  write_file_atomically(file, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

TraceEntry entry_of(const FlowTrace& trace) {
  TraceEntry entry{
      trace.id, trace.created, trace.scene.task, trace.instruction, trace.flow_steps, trace.error, {}};
  if (trace.parent) entry.parent = trace.parent->trace;
  return entry;
}

TraceStore::TraceStore(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
}

std::string TraceStore::add(StoredTrace stored) {
  stored.trace.created = utc_now();
  std::lock_guard lock(mutex_);
  for (;; ++next_) {  // files of earlier runs keep their names
    char id[32];
    std::snprintf(id, sizeof id, "trace-%05d", next_);
    stored.trace.id = id;
    if (!traces_.contains(id) && !std::filesystem::exists(folder_ / (stored.trace.id + ".json"))) break;
  }
  const std::string id = stored.trace.id;
  write_trace_file(folder_ / (id + ".json"), {stored.trace});
  traces_[id] = std::make_shared<const StoredTrace>(std::move(stored));
  return id;
}

std::shared_ptr<const StoredTrace> TraceStore::get(const std::string& id) const {
  std::lock_guard lock(mutex_);
  const auto it = traces_.find(id);
  if (it == traces_.end()) throw ApiError(404, "not_found", "there is no trace " + id);
  return it->second;
}

std::vector<TraceEntry> TraceStore::list() const {
  std::lock_guard lock(mutex_);
  std::vector<TraceEntry> entries;
  for (const auto& [id, stored] : traces_) entries.push_back(entry_of(stored->trace));
  return entries;
}

void TraceStore::remove(const std::string& id) {
  std::lock_guard lock(mutex_);
  if (traces_.erase(id) == 0) throw ApiError(404, "not_found", "there is no trace " + id);
  std::filesystem::remove(folder_ / (id + ".json"));
}

}  // namespace flowscope
