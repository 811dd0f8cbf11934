#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/support/served_fake.h"

namespace flowscope::web {
namespace {

using testing::Connection;
using testing::request_text;
using testing::ServedFake;

const testing::Headers bearer{{"Authorization", "Bearer " + testing::test_token}};

/// A picture of `size` bytes that begins with its number.
FramePtr numbered(std::uint64_t number, std::size_t size = 1000) {
  auto frame = std::make_shared<EncodedFrame>();
  const std::string text = std::to_string(number) + ";";
  frame->jpeg.assign(text.begin(), text.end());
  frame->jpeg.resize(std::max(size, text.size()));
  frame->sequence = number;
  frame->timestamp_s = 1000.5 + static_cast<double>(number);
  return frame;
}

struct Part {
  std::uint64_t number = 0;
  std::string type, timestamp;
  std::size_t length = 0;
};

class Viewer {
 public:
  explicit Viewer(const ServedFake& served, const std::string& target = "/stream", int receive_buffer = 0)
      : connection_(served.server.port(), receive_buffer) {
    connection_.send(request_text("GET", target, bearer));
  }
  std::string head() { return connection_.until("--frame\r\n"); }
  Part part() {
    Part part;
    auto headers = Connection::parse_headers(connection_.until("\r\n\r\n"));
    part.type = headers["content-type"];
    part.timestamp = headers["x-timestamp"];
    part.length = std::strtoul(headers["content-length"].c_str(), nullptr, 10);
    part.number = std::strtoull(connection_.exactly(part.length).c_str(), nullptr, 10);
    end_ = connection_.exactly(11);
    return part;
  }
  bool ended_well() const { return end_ == "\r\n--frame\r\n"; }
  void leave_unread() { connection_.exactly(1); }

 private:
  Connection connection_;
  std::string end_;
};

template <typename Condition>
bool soon(Condition condition) {
  for (int i = 0; i < 500; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

TEST(Stream, PartsCarryLengthAndTime) {
  ServedFake served;
  served.server.publish("main", numbered(7));
  Viewer viewer(served);
  const std::string head = viewer.head();
  EXPECT_NE(head.find("multipart/x-mixed-replace; boundary=frame"), std::string::npos);
  EXPECT_NE(head.find("no-store"), std::string::npos);
  const Part part = viewer.part();
  EXPECT_EQ(part.number, 7u);
  EXPECT_EQ(part.type, "image/jpeg");
  EXPECT_EQ(part.length, 1000u);
  EXPECT_EQ(part.timestamp, "1007.500000");
  EXPECT_TRUE(viewer.ended_well()) << "the boundary follows at once, without waiting for the next picture";
}

TEST(Stream, RepeatsTheLastPictureWhenNothingIsNew) {
  ServedFake served;
  served.server.publish("main", numbered(3));
  Viewer viewer(served, "/?action=stream");
  viewer.head();
  EXPECT_EQ(viewer.part().number, 3u);
  EXPECT_EQ(viewer.part().number, 3u);
}

TEST(Stream, TheFirstRepeatComesSoonForABrowserDrawsAPartWhenTheNextBegins) {
  ServedFake served;
  served.server.publish("main", numbered(3));
  Viewer viewer(served);
  viewer.head();
  const auto pause = [&viewer] {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(viewer.part().number, 3u);
    return std::chrono::steady_clock::now() - begin;
  };
  pause();
  const auto first = pause(), second = pause();
  EXPECT_LT(3 * first, second);
}

TEST(Stream, ViewersAreCountedPerView) {
  ServedFake served;
  {
    Viewer first(served);
    first.head();
    EXPECT_TRUE(soon([&] { return served.backend.viewers == 1; }));
    Viewer second(served, "/stream?view=main");
    second.head();
    EXPECT_TRUE(soon([&] { return served.backend.viewers == 2; }));
  }
  EXPECT_TRUE(soon([&] { return served.backend.viewers == 0; }));
  EXPECT_EQ(served.backend.viewer_changes, 4);
}

TEST(Stream, UnknownViewsAndTooManyStreamsAreRefused) {
  ServerOptions options;
  options.max_streams = 1;
  ServedFake served(options);
  EXPECT_EQ(served.get("/stream?view=nose").status, 404);
  Viewer viewer(served);
  viewer.head();
  EXPECT_EQ(served.get("/stream").status, 503);
}

TEST(Stream, AStalledViewerDelaysNobodyAndGetsTheNewest) {
  ServedFake served;
  Viewer good(served), stalled(served, "/stream", 4096);
  good.head();
  stalled.head();
  EXPECT_TRUE(soon([&] { return served.backend.viewers == 2; }));
  constexpr std::uint64_t pictures = 200;
  // Each picture waits for the good viewer, so every one of them must reach it, whatever the stalled one
  // does.
  for (std::uint64_t n = 1; n <= pictures; ++n) {
    served.server.publish("main", numbered(n, 60000));
    std::uint64_t came = good.part().number;
    while (came + 1 == n && n > 1) came = good.part().number;  // repeated while this test was held up
    ASSERT_EQ(came, n);
  }
  std::uint64_t last = 0, received = 0;
  while (last < pictures) {
    const Part part = stalled.part();
    ASSERT_GE(part.number, last) << "pictures never come out of order";
    received += part.number > last;
    last = part.number;
  }
  EXPECT_LT(received, pictures / 2) << "old pictures were not queued up for it";
}

TEST(Stream, PicturesOfAnotherViewStayThere) {
  ServedFake served;
  served.server.publish("other", numbered(1));
  served.server.publish("main", numbered(2));
  Viewer viewer(served);
  viewer.head();
  EXPECT_EQ(viewer.part().number, 2u);
}

TEST(Stream, StoppingTheServerEndsIt) {
  auto served = std::make_unique<ServedFake>();
  served->server.publish("main", numbered(1));
  Connection connection(served->server.port());
  connection.send(request_text("GET", "/stream", bearer));
  connection.until("\r\n\r\n");
  served.reset();
  connection.rest();  // returns because the stream has ended
  SUCCEED();
}

TEST(Snapshot, HasTheFormatThatWasAskedFor) {
  const ServedFake served;
  EXPECT_EQ(served.get("/snapshot").headers.at("content-type"), "image/jpeg");
  EXPECT_EQ(served.get("/?action=snapshot").body.substr(0, 2), "\xff\xd8");
  const testing::Reply png = served.get("/snapshot?format=png&width=32&height=16");
  EXPECT_EQ(png.headers.at("content-type"), "image/png");
  EXPECT_EQ(png.body.substr(16, 8), std::string("\0\0\0\x20\0\0\0\x10", 8))
      << "width and height in the PNG head";
  EXPECT_EQ(served.get("/snapshot?format=bmp").status, 400);
  EXPECT_EQ(served.get("/snapshot?width=100000").status, 400);
  EXPECT_EQ(served.get("/snapshot?view=nose").status, 404);
}

}  // namespace
}  // namespace flowscope::web
