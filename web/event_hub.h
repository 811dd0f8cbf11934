// What WebSocket clients hear: the newest of each kind for those who join, changes for those who are there.
// I/O thread only.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "web/server.h"

namespace flowscope::web {

/// An event as it goes out. Of two waiting messages with the same key only the newer one matters; an empty
/// key never replaces anything.
struct Message {
  std::string key, text;
};
using MessagePtr = std::shared_ptr<const Message>;

MessagePtr to_message(const Event& event);

class EventClient {
 public:
  virtual ~EventClient() = default;
  virtual void push(const MessagePtr& message) = 0;
  virtual void close(const std::string& reason) = 0;
};

class EventHub {
 public:
  /// False until the present state is known; then the joiner hears it first.
  bool has_state() const { return state_ != nullptr; }
  /// Fills what is not known yet.
  void seed(const std::vector<MessagePtr>& messages);
  void join(const std::shared_ptr<EventClient>& client);
  void leave(const std::shared_ptr<EventClient>& client) { clients_.erase(client); }
  void publish(const MessagePtr& message);
  void close_all(const std::string& reason);

 private:
  bool keep(const MessagePtr& message, bool replace);
  MessagePtr state_, train_;
  std::deque<MessagePtr> jobs_;  ///< in order of appearance, the newest message of each
  std::set<std::shared_ptr<EventClient>> clients_;
};

}  // namespace flowscope::web
