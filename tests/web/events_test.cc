#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/served_fake.h"
#include "web/incoming_meter.h"
#include "web/wire.h"

namespace flowscope::web {
namespace {

using testing::Connection;
using testing::ServedFake;
using wire::Json;

testing::Headers upgrade(testing::Headers headers) {
  headers.insert(headers.end(), {{"Connection", "Upgrade"},
                                 {"Upgrade", "websocket"},
                                 {"Sec-WebSocket-Version", "13"},
                                 {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="}});
  return headers;
}

/// Reads what a server sends: unmasked frames, one per message.
class Listener {
 public:
  explicit Listener(const ServedFake& served, int receive_buffer = 0)
      : connection_(served.server.port(), receive_buffer) {
    connection_.send(testing::request_text("GET", "/api/v1/events",
                                           upgrade({{"Authorization", "Bearer " + testing::test_token}})));
    status = connection_.reply(true).status;
  }
  struct Frame {
    int opcode = -1;
    std::string payload;
  };
  Frame frame() {
    const std::string head = connection_.exactly(2);
    if (head.size() < 2) return {};
    std::size_t size = static_cast<unsigned char>(head[1]) & 0x7f;
    const std::size_t extra = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (extra) {
      size = 0;
      for (const char c : connection_.exactly(extra)) size = size * 256 + static_cast<unsigned char>(c);
    }
    return {head[0] & 0x0f, connection_.exactly(size)};
  }
  Json next() {
    const Frame f = frame();
    return f.opcode == 1 ? Json::parse(f.payload) : Json{{"type", "frame " + std::to_string(f.opcode)}};
  }
  int status = 0;

 private:
  Connection connection_;
};

TEST(Events, AskForTokenAndUpgrade) {
  const ServedFake served;
  const std::uint16_t port = served.server.port();
  EXPECT_EQ(testing::call(port, "GET", "/api/v1/events", upgrade({})).status, 401);
  EXPECT_EQ(testing::call(port, "GET", "/api/v1/events", upgrade({{"Origin", "http://evil.com"}})).status,
            403);
  EXPECT_EQ(served.get("/api/v1/events").status, 426);
  EXPECT_EQ(Listener(served).status, 101);
}

TEST(Events, ThePresentStateComesFirst) {
  ServedFake served;
  served.send("POST", "/api/v1/script", R"({"record":true})");
  Listener first(served);
  Json event = first.next();
  EXPECT_EQ(event["type"], "state");
  EXPECT_EQ(event["data"]["task"], "push_buttons");
  event = first.next();
  EXPECT_EQ(event["type"], "job");
  EXPECT_EQ(event["data"]["id"], "j1");
  EXPECT_EQ(first.next()["type"], "train");

  served.send("POST", "/api/v1/reset", R"({"task":"open_drawer","seed":9})");
  EXPECT_EQ(first.next()["data"]["seed"], 9) << "then the changes";
  Listener second(served);
  EXPECT_EQ(second.next()["data"]["seed"], 9) << "who joins later hears the newest";
}

TEST(Events, EveryKindHasItsName) {
  ServedFake served;
  Listener listener(served);
  EXPECT_EQ(listener.next()["type"], "state");
  EXPECT_EQ(listener.next()["type"], "train");
  served.server.send(LogEvent{"warning", "the table is wet"});
  const Json log = listener.next();
  EXPECT_EQ(log["type"], "log");
  EXPECT_EQ(log["data"]["message"], "the table is wet");
  served.send("POST", "/api/v1/predict", R"({"seed":1})");
  const Json trace = listener.next();
  EXPECT_EQ(trace["type"], "trace");
  EXPECT_EQ(trace["data"]["id"], "t2");
}

TEST(Events, AClientThatFallsBehindIsClosedAndOthersMissNothing) {
  ServedFake served;
  Listener slow(served, 4096), good(served);
  ASSERT_EQ(slow.next()["type"], "state");
  ASSERT_EQ(slow.next()["type"], "train");
  ASSERT_EQ(good.next()["type"], "state");
  ASSERT_EQ(good.next()["type"], "train");
  const std::string filling(20000, 'x');
  constexpr int count = 400;
  for (int n = 0; n < count; ++n) {
    served.server.send(LogEvent{"info", std::to_string(n) + filling});
    ASSERT_EQ(good.next()["data"]["message"].get<std::string>(), std::to_string(n) + filling);
  }
  int received = 0;
  Listener::Frame frame = slow.frame();
  for (; frame.opcode == 1; frame = slow.frame()) ++received;
  EXPECT_LT(received, count) << "nothing is kept for it without bound";
}

TEST(Events, WaitingMessagesOfOneKeyCoalesce) {
  ServedFake served;
  Listener listener(served, 4096);
  ASSERT_EQ(listener.next()["type"], "state");
  ASSERT_EQ(listener.next()["type"], "train");
  JobStatus job;
  job.id = "j9";
  job.state = "running";
  job.message = std::string(20000, 'm');
  constexpr int count = 3000;
  for (int n = 1; n <= count; ++n) {
    job.progress = static_cast<double>(n) / count;
    served.server.send(job);
  }
  int received = 0;
  double last = 0;
  while (last < 1) {
    const Json event = listener.next();
    ASSERT_EQ(event["type"], "job") << "it is never closed: of one job only the newest waits";
    ASSERT_GT(event["data"]["progress"], last);
    last = event["data"]["progress"];
    ++received;
  }
  EXPECT_LT(received, count);
}

bool all_events_clients_left(const ServedFake& served) {
  return served.get("/metrics").body.find("\nflowscope_event_clients 0\n") != std::string::npos;
}

/// Nothing that a client sends is wanted: whoever sends without end is closed.
TEST(Events, EmptyFragmentsWithoutEndEnd) {
  const ServedFake served;
  const std::string first("\x01\x80\0\0\0\0", 6), next("\x00\x80\0\0\0\0", 6);
  std::string many;
  for (int i = 0; i < 5000; ++i) many += next;
  for (const std::string& fragments : {many, next}) {
    Connection connection(served.server.port());
    connection.send(testing::request_text("GET", "/api/v1/events",
                                          upgrade({{"Authorization", "Bearer " + testing::test_token}})));
    ASSERT_EQ(connection.reply(true).status, 101);
    EXPECT_FALSE(all_events_clients_left(served));
    connection.send(first);
    bool gone = false;
    for (int i = 0; i < 200 && !gone; ++i) {
      connection.send(fragments);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      gone = all_events_clients_left(served);
    }
    EXPECT_TRUE(gone) << fragments.size() << " bytes ten times a second";
  }
}

TEST(Events, PingsAndWholeMessagesMayGoOnForEver) {
  IncomingMeter meter;
  for (int second = 0; second < 1000; ++second) {
    meter.transfer_read_bytes(6 + 125 + 6 + 4000);  // a ping, and a message to its end
    meter.saw_control(125);
    if (second % 3 == 0) meter.saw_message();
    ASSERT_FALSE(meter.tick()) << second;
  }
}

}  // namespace
}  // namespace flowscope::web
