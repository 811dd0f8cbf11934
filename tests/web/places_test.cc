// Connections are few: who gets one, who has to go.
#include "web/places.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/served_fake.h"

namespace flowscope::web {
namespace {

using testing::Connection;
using testing::request_text;
using testing::ServedFake;

struct Log {
  std::string gone;
  PlaceHold take(Places& places, char name) {
    return places.take([this, name] { gone += name; });
  }
};

TEST(Places, TheOldestStrangerGoesFirst) {
  Log log;
  Places places(3, 0);
  const auto a = log.take(places, 'a'), b = log.take(places, 'b'), c = log.take(places, 'c');
  EXPECT_EQ(log.gone, "");
  const auto d = log.take(places, 'd'), e = log.take(places, 'e');
  EXPECT_TRUE(d && e);
  EXPECT_EQ(log.gone, "ab");
  EXPECT_EQ(places.taken(), 3);
}

TEST(Places, KnownGuestsStayWhileThereAreStrangers) {
  Log log;
  Places places(3, 0);
  const auto a = log.take(places, 'a'), b = log.take(places, 'b'), c = log.take(places, 'c');
  a->make_known();
  c->make_known();
  const auto d = log.take(places, 'd');
  EXPECT_EQ(log.gone, "b");
  d->make_known();
  a->waits();  // it spoke: now c has been silent longest
  c->waits();
  a->works();
  a->waits();
  d->waits();
  const auto e = log.take(places, 'e');
  EXPECT_EQ(log.gone, "bc");
}

TEST(Places, NobodyIsSentAwayWhoIsWorkedFor) {
  Log log;
  Places places(2, 0);
  auto a = log.take(places, 'a');
  const auto b = log.take(places, 'b');
  a->works();
  b->works();
  EXPECT_FALSE(log.take(places, 'c'));
  EXPECT_FALSE(places.make_room());
  EXPECT_EQ(log.gone, "");
  a = nullptr;
  EXPECT_TRUE(log.take(places, 'd'));
}

TEST(Places, SomeAreOutOfStrangersReach) {
  Log log;
  Places places(4, 2);
  const auto a = log.take(places, 'a'), b = log.take(places, 'b');
  const auto c = log.take(places, 'c');
  EXPECT_EQ(log.gone, "a");
  b->make_known();
  c->make_known();
  const auto d = log.take(places, 'd'), e = log.take(places, 'e');
  EXPECT_EQ(log.gone, "a");
  EXPECT_EQ(places.taken(), 4);
}

TEST(Connections, HalfOpenOnesStandInNobodysWay) {
  ServerOptions options;
  options.max_connections = 8;
  const ServedFake served(options);
  const testing::Headers bearer{{"Authorization", "Bearer " + testing::test_token}};
  Connection known(served.server.port());
  known.send(request_text("GET", "/api/v1/state", bearer));
  EXPECT_EQ(known.reply().status, 200);
  std::vector<std::unique_ptr<Connection>> silent;
  for (int i = 0; i < 60; ++i) {
    silent.push_back(std::make_unique<Connection>(served.server.port()));
    if (i % 3 == 1) silent.back()->send("GET /api/v1/st");
    if (i % 3 == 2) silent.back()->send(request_text("POST", "/api/v1/reset", {{"Content-Length", "100"}}));
    if (i % 5 == 0) {
      EXPECT_EQ(served.get("/api/v1/state").status, 200) << i;
    }
  }
  known.send(request_text("GET", "/api/v1/state", bearer));
  EXPECT_EQ(known.reply().status, 200) << "who showed the token keeps its connection";
}

TEST(Connections, WhenAllAreAtWorkNewOnesAreTurnedAway) {
  ServerOptions options;
  options.max_connections = 2;
  const ServedFake served(options);
  const testing::Headers bearer{{"Authorization", "Bearer " + testing::test_token}};
  Connection first(served.server.port()), second(served.server.port());
  for (Connection* viewer : {&first, &second}) {
    viewer->send(request_text("GET", "/stream", bearer));
    EXPECT_EQ(viewer->reply(true).status, 200);
  }
  Connection third(served.server.port());
  const testing::Reply reply = third.reply();
  EXPECT_EQ(reply.status, 503);
  EXPECT_NE(reply.body.find("too_many_connections"), std::string::npos);
}

}  // namespace
}  // namespace flowscope::web
