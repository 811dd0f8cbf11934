#include "app/trace_store.h"

#include <spdlog/spdlog.h>

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

namespace {

std::filesystem::path made(std::filesystem::path folder) {
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace

TraceStore::TraceStore(std::filesystem::path folder) : folder_(made(std::move(folder))), shelf_(folder_) {}

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
  TraceEntry entry = entry_of(stored.trace);
  traces_[id] = {std::move(entry), std::make_shared<const StoredTrace>(std::move(stored))};
  in_memory_.push_back(id);
  shelve_older();
  return id;
}

void TraceStore::shelve_older() {
  try {
    while (in_memory_.size() > newest_in_memory) {
      Kept& oldest = traces_.at(in_memory_.front());
      oldest.place = shelf_.put(*oldest.whole);
      oldest.whole = nullptr;
      in_memory_.pop_front();
    }
  } catch (const std::system_error& error) {
    spdlog::warn("{}: it stays in memory", error.what());
  }
}

std::shared_ptr<const StoredTrace> TraceStore::get(const std::string& id) const {
  std::lock_guard lock(mutex_);
  const auto it = traces_.find(id);
  if (it == traces_.end()) throw ApiError(404, "not_found", "there is no trace " + id);
  const Kept& kept = it->second;
  return kept.whole ? kept.whole : std::make_shared<const StoredTrace>(shelf_.take(kept.place));
}

std::vector<TraceEntry> TraceStore::list() const {
  std::lock_guard lock(mutex_);
  std::vector<TraceEntry> entries;
  for (const auto& [id, kept] : traces_) entries.push_back(kept.entry);
  return entries;
}

void TraceStore::remove(const std::string& id) {
  std::lock_guard lock(mutex_);
  const auto it = traces_.find(id);
  if (it == traces_.end()) throw ApiError(404, "not_found", "there is no trace " + id);
  if (!it->second.whole) shelf_.drop(it->second.place);
  traces_.erase(it);
  std::erase(in_memory_, id);
  std::filesystem::remove(folder_ / (id + ".json"));
}

}  // namespace flowscope
