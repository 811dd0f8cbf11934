#include "web/event_hub.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "web/wire.h"

namespace flowscope::web {

namespace {

constexpr std::size_t most_jobs = 100;

struct Describe {
  std::string type, key;
  wire::Json data;

  void operator()(const StateSnapshot& state) { *this = {"state", "state", wire::to_json(state)}; }
  void operator()(const JobStatus& job) { *this = {"job", "job:" + job.id, wire::to_json(job)}; }
  void operator()(const TrainReport& report) { *this = {"train", "train", wire::to_json(report)}; }
  void operator()(const TraceEntry& entry) { *this = {"trace", "trace:" + entry.id, wire::to_json(entry)}; }
  void operator()(const LogEvent& log) {
    *this = {"log", "", wire::Json{{"level", log.level}, {"message", log.message}}};
  }
};

}  // namespace

MessagePtr to_message(const Event& event) {
  Describe describe;
  std::visit(describe, event);
  const wire::Json json{{"type", describe.type}, {"data", std::move(describe.data)}};
  return std::make_shared<const Message>(Message{describe.key, wire::dump(json)});
}

bool EventHub::keep(const MessagePtr& message, bool replace) {
  const auto set = [&](MessagePtr& slot) {
    if (slot && !replace) return false;
    slot = message;
    return true;
  };
  if (message->key == "state") return set(state_);
  if (message->key == "train") return set(train_);
  if (!message->key.starts_with("job:")) return false;
  const auto known = std::find_if(jobs_.begin(), jobs_.end(),
                                  [&](const MessagePtr& job) { return job->key == message->key; });
  if (known != jobs_.end()) return set(*known);
  jobs_.push_back(message);
  if (jobs_.size() > most_jobs) jobs_.pop_front();
  return true;
}

void EventHub::seed(const std::vector<MessagePtr>& messages) {
  for (const MessagePtr& message : messages) keep(message, false);
}

void EventHub::join(const std::shared_ptr<EventClient>& client) {
  if (state_) client->push(state_);
  for (const MessagePtr& job : jobs_) client->push(job);
  if (train_) client->push(train_);
  clients_.insert(client);
}

void EventHub::publish(const MessagePtr& message) {
  keep(message, true);
  const auto clients = clients_;  // a client that falls behind leaves while we go
  for (const auto& client : clients) client->push(message);
}

void EventHub::close_all(const std::string& reason) {
  const auto clients = clients_;
  for (const auto& client : clients) client->close(reason);
}

}  // namespace flowscope::web
