// Where one request ends and the next begins: what two readers could see differently is refused and ends the
// connection.
#include "web/framing.h"

#include <gtest/gtest.h>

#include <chrono>

#include "tests/support/served_fake.h"

namespace flowscope::web {
namespace {

using testing::Connection;
using testing::Reply;
using testing::ServedFake;

std::string head(const std::string& headers, const std::string& version = "HTTP/1.1") {
  return "POST /api/v1/reset " + version + "\r\nHost: localhost\r\n" + headers + "\r\n";
}

bool sound(const std::string& text) {
  try {
    check_framing(text);
    return true;
  } catch (const ApiError& error) {
    EXPECT_EQ(error.status, 400);
    EXPECT_FALSE(error.where.empty());
    return false;
  }
}

TEST(Framing, OneLengthOrChunkedPasses) {
  for (const char* headers : {"", "Content-Length: 0\r\n", "Content-Length: 5\r\n", "content-length:5\r\n",
                              "Content-Length:  5 \r\n", "Transfer-Encoding: chunked\r\n",
                              "TRANSFER-ENCODING:chunked \r\n", "Accept: a\r\nAccept: b\r\n"})
    EXPECT_TRUE(sound(head(headers))) << headers;
}

const std::vector<std::string> encodings{"identity",
                                         "gzip",
                                         "gzip, chunked",
                                         "chunked, gzip",
                                         "chunked, chunked",
                                         "chunked,",
                                         ",chunked",
                                         "chunked;q=1",
                                         "\"chunked\"",
                                         "xchunked",
                                         "chunkedx",
                                         "chunke",
                                         "Chunked",
                                         "CHUNKED",
                                         "chunked, identity",
                                         "identity, chunked",
                                         "",
                                         "chunked chunked",
                                         "\x0b"
                                         "chunked",
                                         "0"};
const std::vector<std::string> lengths{
    "-5", "+5", "0x5", "5, 5", "5,5", "5 5", "5.0", "5e0", "", "five", "99999999999999999999", "\"5\"", "5;"};

TEST(Framing, EveryOtherFormIsRefused) {
  for (const std::string& value : encodings)
    EXPECT_FALSE(sound(head("Transfer-Encoding: " + value + "\r\n"))) << value;
  for (const std::string& value : lengths)
    EXPECT_FALSE(sound(head("Content-Length: " + value + "\r\n"))) << value;
  for (const char* headers :
       {"Content-Length: 5\r\nContent-Length: 5\r\n", "Content-Length: 5\r\nX: y\r\ncontent-length: 6\r\n",
        "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n",
        "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: gzip\r\nTransfer-Encoding: chunked\r\n", "Host: localhost\r\n", "X: a\r\n b\r\n",
        "X: a\r\n\tb\r\n", "Transfer-Encoding:\r\n chunked\r\n", "Content-Length: 5\r\n 0\r\n"})
    EXPECT_FALSE(sound(head(headers))) << headers;
  EXPECT_FALSE(sound(head("Transfer-Encoding: chunked\r\n", "HTTP/1.0")));
  EXPECT_FALSE(sound("GET / HTTP/1.1\r\nAccept: */*\r\n\r\n"));
}

/// What the server does with a request in doubt and another that follows it at once.
std::string answers_to(const ServedFake& served, const std::string& bytes) {
  Connection connection(served.server.port());
  connection.send(bytes);
  return connection.rest();
}

TEST(Framing, NoBodyIsReadAsTheNextRequest) {
  const ServedFake served;
  const std::string hidden = "GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n";
  std::vector<std::string> doubtful;
  for (const std::string& value : encodings) doubtful.push_back(head("Transfer-Encoding: " + value + "\r\n"));
  for (const std::string& value : lengths) doubtful.push_back(head("Content-Length: " + value + "\r\n"));
  doubtful.push_back(head("Content-Length: 5\r\nContent-Length: 5\r\n"));
  doubtful.push_back(head("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n"));
  doubtful.push_back(head("Transfer-Encoding: chunked\r\n", "HTTP/1.0"));
  doubtful.push_back(head("X: a\r\n b\r\n"));
  for (const std::string& request : doubtful) {
    const std::string answers = answers_to(served, request + hidden);
    EXPECT_TRUE(answers.starts_with("HTTP/1.1 4")) << request << answers;
    EXPECT_NE(answers.find("Connection: close"), std::string::npos) << request;
    EXPECT_EQ(answers.find("HTTP/1.1 ", 1), std::string::npos)
        << request << " was answered twice: " << answers;
  }
}

TEST(Framing, ChunkedBodiesArriveAndExtensionsAreBounded) {
  const ServedFake served;
  const std::string start = "POST /api/v1/reset HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer " +
                            testing::test_token +
                            "\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n";
  const auto status = [&](const std::string& chunks) {
    Connection connection(served.server.port());
    connection.send(start + chunks);
    return connection.reply().status;
  };
  EXPECT_EQ(status("7\r\n{\"task\"\r\n10\r\n: \"open_drawer\"}\r\n0\r\n\r\n"), 200);
  EXPECT_EQ(status("17;a=b\r\n{\"task\": \"open_drawer\"}\r\n0\r\n\r\n"), 200);
  EXPECT_EQ(status("17;" + std::string(2000, 'a') + "\r\n{\"task\": \"open_drawer\"}\r\n0\r\n\r\n"), 400);
  EXPECT_EQ(status("17;" + std::string(100'000, 'a')), 400) << "a line without an end";
  std::string many;
  for (int i = 0; i < 200; ++i) many += "1;abcdefgh=12345678\r\n \r\n";
  EXPECT_EQ(status(many + "0\r\n\r\n"), 400);
}

TEST(Framing, AClientThatAsksForLeaveGetsIt) {
  const ServedFake served;
  const std::string body = R"({"task":"open_drawer"})";
  const testing::Headers headers{{"Authorization", "Bearer " + testing::test_token},
                                 {"Content-Type", "application/json"},
                                 {"Content-Length", std::to_string(body.size())},
                                 {"Expect", "100-continue"}};
  Connection connection(served.server.port());
  connection.send(testing::request_text("POST", "/api/v1/reset", headers));
  EXPECT_EQ(connection.until("\r\n\r\n"), "HTTP/1.1 100 Continue\r\n\r\n");
  connection.send(body);
  EXPECT_EQ(connection.reply().status, 200);

  testing::Headers stranger = headers;
  stranger.front().second = "Bearer wrong";
  Connection refused(served.server.port());
  refused.send(testing::request_text("POST", "/api/v1/reset", stranger));
  EXPECT_EQ(refused.reply().status, 401) << "before any body is sent";

  testing::Headers odd = headers;
  odd.back().second = "a miracle";
  Connection other(served.server.port());
  other.send(testing::request_text("POST", "/api/v1/reset", odd));
  EXPECT_EQ(other.reply().status, 417);
}

}  // namespace
}  // namespace flowscope::web
