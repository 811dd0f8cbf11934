// What arrives on the wire: good, odd, oversized and hostile.
#include "web/http.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "tests/support/served_fake.h"

namespace flowscope::web {
namespace {

using testing::Connection;
using testing::Reply;
using testing::request_text;
using testing::ServedFake;

std::string code(const Reply& reply) { return wire::Json::parse(reply.body)["error"]["code"]; }

Reply answer_to(const ServedFake& served, const std::string& bytes) {
  Connection connection(served.server.port());
  connection.send(bytes);
  return connection.reply();
}

const testing::Headers bearer{{"Authorization", "Bearer " + testing::test_token}};

TEST(Http, HealthTellsLoadingFromReady) {
  ServedFake served;
  served.backend.ready = false;
  Reply reply = testing::call(served.server.port(), "GET", "/health");
  EXPECT_EQ(reply.status, 503);
  EXPECT_EQ(wire::Json::parse(reply.body)["status"], "loading");
  served.backend.ready = true;
  reply = testing::call(served.server.port(), "GET", "/health");
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, R"({"status":"ready"})");
}

TEST(Http, OneConnectionCarriesManyRequests) {
  const ServedFake served;
  Connection connection(served.server.port());
  for (int i = 0; i < 20; ++i) {
    connection.send(request_text("GET", "/api/v1/state", bearer));
    EXPECT_EQ(connection.reply().status, 200);
  }
  std::string pipelined;
  for (int i = 0; i < 20; ++i) pipelined += request_text("GET", "/health");
  connection.send(pipelined);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(connection.reply().status, 200);
}

TEST(Http, HeadAnswersWithoutBody) {
  const ServedFake served;
  Connection connection(served.server.port());
  connection.send(request_text("HEAD", "/api/v1/tasks", bearer) + request_text("HEAD", "/stream", bearer) +
                  request_text("GET", "/health"));
  const Reply head = connection.reply(true);
  EXPECT_EQ(head.status, 200);
  EXPECT_NE(head.headers.at("content-length"), "0");
  EXPECT_TRUE(connection.reply(true).headers.at("content-type").starts_with("multipart/x-mixed-replace"));
  EXPECT_EQ(connection.reply().body, R"({"status":"ready"})");
}

TEST(Http, WrongMethodsNameTheRightOnes) {
  const ServedFake served;
  const Reply reply = served.send("POST", "/api/v1/state", "{}");
  EXPECT_EQ(reply.status, 405);
  EXPECT_EQ(reply.headers.at("allow"), "GET, HEAD");
  EXPECT_EQ(served.send("PATCH", "/api/v1/views/main", "{}").headers.at("allow"), "GET, HEAD, PUT");
  EXPECT_EQ(served.send("BREW", "/api/v1/state").status, 405);
  EXPECT_EQ(served.get("/api/v1/nothing").status, 404);
  EXPECT_EQ(code(served.get("/api/v1/nothing")), "not_found");
}

TEST(Http, BodiesMustBeJson) {
  const ServedFake served;
  testing::Headers headers = bearer;
  headers.emplace_back("Content-Type", "text/plain");
  const Reply reply =
      testing::call(served.server.port(), "POST", "/api/v1/reset", headers, R"({"task":"open_drawer"})");
  EXPECT_EQ(reply.status, 415);
  EXPECT_EQ(served.send("POST", "/api/v1/reset", "{").status, 400);
  const Reply deep = served.send("POST", "/api/v1/reset", std::string(100000, '['));
  EXPECT_EQ(code(deep), "too_deep");
  EXPECT_EQ(served.get("/health").status, 200);
}

TEST(Http, OversizedRequestsAreRefused) {
  const ServedFake served;
  EXPECT_EQ(served.send("POST", "/api/v1/reset", std::string(300 * 1024, ' ')).status, 413);
  EXPECT_EQ(answer_to(served,
                      "POST /api/v1/reset HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n")
                .status,
            413);
  std::string chunked =
      "POST /api/v1/reset HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nAuthorization: "
      "Bearer " +
      testing::test_token + "\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 40; ++i) chunked += "2000\r\n" + std::string(0x2000, ' ') + "\r\n";
  EXPECT_EQ(answer_to(served, chunked).status, 413);
  EXPECT_EQ(served.get("/health", {{"X-Long", std::string(9000, 'a')}}).status, 431);
  std::string many = "GET /health HTTP/1.1\r\nHost: localhost\r\n";
  for (int i = 0; i < 100000; ++i) many += "a: b\r\n";
  EXPECT_EQ(answer_to(served, many + "\r\n").status, 431);
}

TEST(Http, MalformedRequestsGetAnErrorOrTheDoor) {
  const ServedFake served;
  const std::string host = "Host: localhost\r\n";
  for (const std::string& bytes : std::vector<std::string>{
           "GET\r\n\r\n",
           "GET / \r\n\r\n",
           "\x16\x03\x01\x02",
           "GET / HTTP/9.9\r\n" + host + "\r\n",
           "GET / HTTP/1.1\r\n\r\n",
           "GET / HTTP/1.1\r\n" + host + host + "\r\n",
           "GET http://evil.com/ HTTP/1.1\r\n" + host + "\r\n",
           "CONNECT evil.com:80 HTTP/1.1\r\n" + host + "\r\n",
           "GET /%zz HTTP/1.1\r\n" + host + "\r\n",
           "GET /%00 HTTP/1.1\r\n" + host + "\r\n",
           "GET /%0d%0aSet-Cookie:x HTTP/1.1\r\n" + host + "\r\n",
           "GET /?a=%f HTTP/1.1\r\n" + host + "\r\n",
           "GET * HTTP/1.1\r\n" + host + "\r\n",
           "POST /api/v1/reset HTTP/1.1\r\n" + host + "Content-Length: -1\r\n\r\n",
           "POST /api/v1/reset HTTP/1.1\r\n" + host + "Content-Length: +5\r\n\r\nabcde",
           "POST /api/v1/reset HTTP/1.1\r\n" + host + "Content-Length: 1\r\nContent-Length: 2\r\n\r\nab",
           "POST /api/v1/reset HTTP/1.1\r\n" + host +
               "Content-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
           "POST /api/v1/reset HTTP/1.1\r\n" + host + "Transfer-Encoding: chunked\r\n\r\nzz\r\n",
           "GET / HTTP/1.1\r\n" + host + "bad header\r\n\r\n",
           "GET / HTTP/1.1\r\n" + host + "a\x01: b\r\n\r\n"}) {
    const int status = answer_to(served, bytes).status;
    EXPECT_TRUE(status == 0 || (status >= 400 && status < 500)) << status << " for " << bytes.substr(0, 60);
  }
  EXPECT_EQ(testing::call(served.server.port(), "GET", "/health").status, 200);
}

TEST(Http, TheTokenLeavesTheAddressBar) {
  const ServedFake served;
  const Reply reply =
      testing::call(served.server.port(), "GET", "/?token=" + testing::test_token + "&tab=debug");
  EXPECT_EQ(reply.status, 303);
  EXPECT_EQ(reply.headers.at("location"), "./?tab=debug");
  const std::string cookie = reply.headers.at("set-cookie");
  EXPECT_NE(cookie.find("HttpOnly"), std::string::npos);
  EXPECT_NE(cookie.find("SameSite=Strict"), std::string::npos);
  const std::string jar = cookie.substr(0, cookie.find(';'));
  const std::uint16_t port = served.server.port();
  EXPECT_EQ(testing::call(port, "GET", "/", {{"Cookie", jar}}).status, 200);
  EXPECT_EQ(testing::call(port, "POST", "/api/v1/traces/t1/execute", {{"Cookie", jar}}).status, 401);
  EXPECT_EQ(testing::call(port, "POST", "/api/v1/traces/t1/execute",
                          {{"Cookie", jar}, {"Origin", "http://localhost"}})
                .status,
            202);
}

TEST(Http, ALinkOnAForeignPageStillOpensOurs) {
  const ServedFake served;
  const Reply reply = testing::call(served.server.port(), "GET", "/?token=" + testing::test_token,
                                    {{"Sec-Fetch-Site", "cross-site"}, {"Sec-Fetch-Mode", "navigate"}});
  EXPECT_EQ(reply.status, 200);
  EXPECT_TRUE(reply.headers.contains("set-cookie"));
  EXPECT_NE(reply.body.find("url=./\""), std::string::npos);
  EXPECT_EQ(reply.body.find(testing::test_token), std::string::npos);
}

TEST(Http, WithoutTokenNobodyIsAskedButForeignPagesStayOut) {
  const ServedFake served({}, false);
  const std::uint16_t port = served.server.port();
  EXPECT_EQ(served.server.url(), "http://127.0.0.1:" + std::to_string(port) + "/");
  EXPECT_EQ(testing::call(port, "GET", "/api/v1/state").status, 200);
  EXPECT_EQ(testing::call(port, "GET", "/api/v1/state", {{"Host", "evil.com"}}).status, 403);
  EXPECT_EQ(testing::call(port, "POST", "/api/v1/traces/t1/execute", {{"Origin", "http://evil.com"}}).status,
            403);
}

TEST(Http, EveryAnswerCarriesTheGuards) {
  const ServedFake served;
  for (const Reply& reply : {served.get("/"), served.get("/api/v1/state"), served.get("/nothing")}) {
    EXPECT_EQ(reply.headers.at("x-content-type-options"), "nosniff");
    EXPECT_EQ(reply.headers.at("referrer-policy"), "no-referrer");
    EXPECT_EQ(reply.headers.at("cross-origin-resource-policy"), "same-origin");
    EXPECT_NE(reply.headers.at("content-security-policy").find("default-src 'self'"), std::string::npos);
    EXPECT_FALSE(reply.headers.contains("access-control-allow-origin"));
  }
}

TEST(Page, ServesItsFolderAndNothingElse) {
  const testing::FakeBackend files;  // lends its folder
  const auto root = files.exports() / "site";
  std::filesystem::create_directories(root / "assets");
  std::ofstream(root / "index.html") << "<!doctype html>page";
  std::ofstream(root / "assets" / "app-1a2b.js") << "run()";
  std::ofstream(root / ".hidden") << "secret";
  std::ofstream(files.exports() / "secret.txt") << "secret";
  std::filesystem::create_symlink(files.exports() / "secret.txt", root / "link.txt");
  ServerOptions options;
  options.page = root;
  const ServedFake served(options);
  EXPECT_EQ(served.get("/").body, "<!doctype html>page");
  const Reply script = served.get("/assets/app-1a2b.js");
  EXPECT_EQ(script.body, "run()");
  EXPECT_TRUE(script.headers.at("content-type").starts_with("text/javascript"));
  for (const char* path : {"/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "/%2e%2e%2fsecret.txt",
                           "/%252e%252e/secret.txt", "/assets/../../secret.txt",
                           "/assets/%2e%2e/%2e%2e/secret.txt", "//secret.txt", "/.hidden", "/assets/.",
                           "/assets", "/assets/", "/link.txt", "/..\\secret.txt", "/%c0%ae%c0%ae/secret.txt",
                           "/etc/passwd", "/%2fetc%2fpasswd", "/assets/app-1a2b.js/", "/index.html%20"}) {
    const Reply reply = served.get(path);
    EXPECT_EQ(reply.status, 404) << path;
    EXPECT_EQ(reply.body.find("secret\n"), std::string::npos) << path;
  }
}

TEST(Exports, AreServedWholeAndInPieces) {
  const ServedFake served;
  served.send("POST", "/api/v1/export", R"({"kind":"png","width":64,"height":48})");
  const std::string path = "/exports/figure-1.png";
  const Reply whole = served.get(path);
  ASSERT_EQ(whole.status, 200);
  EXPECT_EQ(whole.headers.at("content-type"), "image/png");
  EXPECT_NE(whole.headers.at("content-disposition").find("figure-1.png"), std::string::npos);
  const Reply piece = served.get(path, {{"Range", "bytes=1-3"}});
  EXPECT_EQ(piece.status, 206);
  EXPECT_EQ(piece.body, "PNG");
  EXPECT_EQ(piece.headers.at("content-range"), "bytes 1-3/" + std::to_string(whole.body.size()));
  EXPECT_EQ(served.get(path, {{"Range", "bytes=0-"}}).body, whole.body);
  EXPECT_EQ(served.get(path, {{"Range", "bytes=-4"}}).body, whole.body.substr(whole.body.size() - 4));
  EXPECT_EQ(served.get(path, {{"Range", "bytes=99999999-"}}).status, 416);
  for (const char* name : {"/exports/..%2fsecret", "/exports/.hidden", "/exports/a/b", "/exports/"})
    EXPECT_EQ(served.get(name).status, 404) << name;
}

TEST(Exports, LargeFilesArriveUnchanged) {
  const ServedFake served;
  std::string content(3'000'001, 'x');
  for (std::size_t i = 0; i < content.size(); i += 997) content[i] = static_cast<char>('a' + i % 26);
  std::ofstream(served.backend.exports() / "film.mp4", std::ios::binary) << content;
  const Reply reply = served.get("/exports/film.mp4");
  EXPECT_EQ(reply.headers.at("content-type"), "video/mp4");
  EXPECT_TRUE(reply.body == content);
}

TEST(Http, AFailureInsideIsAnAnswerToo) {
  class Broken : public testing::FakeBackend {
   public:
    std::vector<TaskEntry> tasks() override { throw std::runtime_error("disk on fire"); }
    std::vector<DemoInfo> demos() override { throw 7; }
  } broken;
  ServerOptions options;
  options.port = 0;
  Server server(options, broken);
  const Reply reply = testing::call(server.port(), "GET", "/api/v1/tasks");
  EXPECT_EQ(reply.status, 500);
  EXPECT_EQ(code(reply), "internal");
  EXPECT_EQ(testing::call(server.port(), "GET", "/api/v1/demos").status, 500);
  EXPECT_EQ(testing::call(server.port(), "GET", "/api/v1/state").status, 200);
}

TEST(Server, NamesThePortThatIsTaken) {
  ServedFake served;
  ServerOptions options;
  options.port = served.server.port();
  try {
    const Server second(options, served.backend);
    FAIL() << "two servers on one port";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code(), std::errc::address_in_use);
    EXPECT_NE(std::string(error.what()).find("127.0.0.1:" + std::to_string(options.port)), std::string::npos);
  }
}

TEST(Server, MetricsCount) {
  const ServedFake served;
  served.get("/nothing");
  const std::string text = served.get("/metrics").body;
  EXPECT_NE(text.find("\nflowscope_http_client_errors_total 1\n"), std::string::npos) << text;
  EXPECT_NE(text.find("\nflowscope_http_requests_total 2\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace flowscope::web
