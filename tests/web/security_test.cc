#include "web/security.h"

#include <gtest/gtest.h>

namespace flowscope::web {
namespace {

const std::string token = "0123456789abcdef0123456789abcdef";

int origin_status(const Gate& gate, Credentials request, bool page = false) {
  if (request.method.empty()) request.method = "GET";
  try {
    gate.check_origin(request, page);
    return 200;
  } catch (const ApiError& error) {
    return error.status;
  }
}

int token_status(Credentials request) {
  try {
    Gate("127.0.0.1", token).check_token(request);
    return 200;
  } catch (const ApiError& error) {
    return error.status;
  }
}

TEST(Host, OnlyNamesOfThisMachinePass) {
  const Gate gate("127.0.0.1", token);
  for (const char* host : {"localhost", "localhost:8080", "LOCALHOST:1", "127.0.0.1", "127.0.0.1:8080",
                           "127.9.9.9:80", "[::1]", "[::1]:8080"})
    EXPECT_EQ(origin_status(gate, {.host = host}), 200) << host;
  for (const char* host : {"",
                           "evil.com",
                           "evil.com:8080",
                           "127.0.0.1.evil.com",
                           "localhost.evil.com",
                           "localhost:8080@evil.com",
                           "evil.com@localhost",
                           "0.0.0.0",
                           "0.0.0.0:8080",
                           "[::]",
                           "[::]:8080",
                           "2130706433",
                           "0x7f000001",
                           "0x7f.1",
                           "127.1",
                           "0177.0.0.1",
                           "localhost.",
                           "127.0.0.1.",
                           "192.168.1.5",
                           "10.0.0.1:8080",
                           "localhost:",
                           "localhost:80a",
                           "localhost:999999",
                           "localhost:80:80",
                           "[::1",
                           "::1",
                           "[localhost]",
                           "local host",
                           "evil.com#localhost",
                           "localhost/",
                           "my-machine.local",
                           "*",
                           "null",
                           "localhost,evil.com"})
    EXPECT_EQ(origin_status(gate, {.host = host}), 403) << host;
}

TEST(Host, NumbersPassWhenEveryAddressIsServed) {
  const Gate gate("0.0.0.0", token);
  EXPECT_EQ(origin_status(gate, {.host = "192.168.1.5:8080"}), 200);
  EXPECT_EQ(origin_status(gate, {.host = "[fd00::5]:8080"}), 200);
  EXPECT_EQ(origin_status(gate, {.host = "evil.com"}), 403);
  EXPECT_EQ(origin_status(gate, {.host = "0.0.0.0:8080"}), 403);
}

TEST(Host, TheNameThatWasAskedForPasses) {
  const Gate gate("Robot.lab", token);
  EXPECT_EQ(origin_status(gate, {.host = "robot.lab:8080"}), 200);
  EXPECT_EQ(origin_status(gate, {.host = "evil.robot.lab:8080"}), 403);
}

std::string complaint(const Gate& gate, Credentials request) {
  request.method = "GET";
  try {
    gate.check_origin(request, false);
    return "";
  } catch (const ApiError& error) {
    return error.what();
  }
}

TEST(Host, NamesThatWereAllowedPassAndOthersAreToldHow) {
  const Gate gate("127.0.0.1", token, {"Robot.example.com", "10.0.0.7", "fd00::5"});
  for (const char* host : {"robot.example.com", "robot.example.com:443", "ROBOT.example.com:8080",
                           "10.0.0.7:80", "[fd00::5]:8080", "localhost"})
    EXPECT_EQ(origin_status(gate, {.host = host}), 200) << host;
  for (const char* host : {"example.com", "x.robot.example.com", "robot.example.com.evil.com", "10.0.0.8",
                           "robot.example.com:80:80"})
    EXPECT_EQ(origin_status(gate, {.host = host}), 403) << host;
  EXPECT_NE(complaint(gate, {.host = "lab.example.org:8443"}).find("--allow-host lab.example.org"),
            std::string::npos);
  EXPECT_EQ(complaint(gate, {.host = "<script>"}).find("<script>"), std::string::npos);
  const std::string page =
      complaint(gate, {.host = "localhost", .origin = "https://lab.example.org:8443", .has_origin = true});
  EXPECT_NE(page.find("--allow-host lab.example.org"), std::string::npos) << page;
}

TEST(Host, OnlyNamesCanBeAllowed) {
  for (const char* name :
       {"", "*", "*.example.com", "http://robot", "robot:8080", "robot/lab", "two names", "0.0.0.0", "::"})
    EXPECT_THROW(Gate("127.0.0.1", token, {name}), std::invalid_argument) << name;
}

TEST(Origin, AnAllowedNameMayStandBehindAProxy) {
  const Gate gate("127.0.0.1", token, {"hub.example.com"});
  const auto status = [&](const char* host, const char* origin) {
    return origin_status(gate, {.host = host, .origin = origin, .has_origin = true});
  };
  // The proxy hands Host on, adds TLS, drops the port, or puts our own address in.
  EXPECT_EQ(status("hub.example.com", "http://hub.example.com"), 200);
  EXPECT_EQ(status("hub.example.com", "https://hub.example.com"), 200);
  EXPECT_EQ(status("hub.example.com:443", "https://hub.example.com"), 200);
  EXPECT_EQ(status("hub.example.com:8443", "https://hub.example.com:8443"), 200);
  EXPECT_EQ(status("hub.example.com", "https://hub.example.com:8443"), 200);
  EXPECT_EQ(status("127.0.0.1:8080", "https://hub.example.com"), 200);
  EXPECT_EQ(status("hub.example.com:8443", "https://hub.example.com:9999"), 403);
  EXPECT_EQ(status("hub.example.com:8443", "https://hub.example.com"), 403);
  for (const char* origin :
       {"https://evil.com", "https://hub.example.com.evil.com", "https://evil.com/hub.example.com", "null",
        "", "ftp://hub.example.com", "https://hub.example.com@evil.com", "https://localhost:8080"})
    EXPECT_EQ(status("hub.example.com", origin), 403) << origin;
  EXPECT_EQ(origin_status(gate, {.host = "hub.example.com",
                                 .origin = "https://hub.example.com",
                                 .fetch_site = "same-site",
                                 .has_origin = true}),
            403);
}

TEST(Cookie, IsNamedByPortAndFoundAmongOthers) {
  Gate first("127.0.0.1", token), second("127.0.0.1", std::string(32, 'b'), {}, "/proxy/8081");
  first.serve_on(8080);
  second.serve_on(8081);
  EXPECT_TRUE(first.cookie().starts_with("flowscope_token_8080=" + token)) << first.cookie();
  EXPECT_TRUE(second.cookie().ends_with("; Path=/proxy/8081/")) << second.cookie();
  const std::string jar = "flowscope_token_8081=" + std::string(32, 'b') +
                          "; flowscope_token_8080=old; flowscope_token_8080=" + token;
  EXPECT_NO_THROW(first.check_token({.method = "GET", .cookie = jar}));
  EXPECT_NO_THROW(second.check_token({.method = "GET", .cookie = jar}));
}

TEST(Origin, OnlyOurOwnPagePasses) {
  const Gate gate("127.0.0.1", token);
  const auto status = [&](const char* origin) {
    return origin_status(gate, {.host = "localhost:8080", .origin = origin, .has_origin = true});
  };
  EXPECT_EQ(status("http://localhost:8080"), 200);
  EXPECT_EQ(status("http://LOCALHOST:8080"), 200);
  for (const char* origin : {"",
                             "null",
                             "http://localhost",
                             "http://localhost:8081",
                             "https://localhost:8080",
                             "http://localhost:8080.evil.com",
                             "http://evil.com",
                             "http://localhost:80801",
                             "http://evil.com/http://localhost:8080",
                             "http://localhost:8080/",
                             "http://127.0.0.1:8080",
                             "http://localhost.evil.com:8080",
                             "http://evillocalhost:8080",
                             "file://",
                             "http://localhost:8080@evil.com",
                             "ftp://localhost:8080",
                             "localhost:8080",
                             "http://[::1]:8080",
                             "http://user@localhost:8080",
                             "chrome-extension://abc"})
    EXPECT_EQ(status(origin), 403) << origin;
}

TEST(Origin, TheBrowsersWordCounts) {
  const Gate gate("127.0.0.1", token);
  Credentials request{.method = "GET", .host = "localhost"};
  for (const char* site : {"", "none", "same-origin"}) {
    request.fetch_site = site;
    EXPECT_EQ(origin_status(gate, request), 200) << site;
  }
  for (const char* site : {"cross-site", "same-site", "nonsense"}) {
    request.fetch_site = site;
    EXPECT_EQ(origin_status(gate, request), 403) << site;
  }
}

TEST(Origin, AForeignLinkMayOpenThePageAndNothingElse) {
  const Gate gate("127.0.0.1", token);
  Credentials request{
      .method = "GET", .host = "localhost", .fetch_site = "cross-site", .fetch_mode = "navigate"};
  EXPECT_EQ(origin_status(gate, request, true), 200);
  EXPECT_EQ(origin_status(gate, request, false), 403);
  request.fetch_mode = "no-cors";
  EXPECT_EQ(origin_status(gate, request, true), 403);
  request.fetch_mode = "navigate";
  request.method = "POST";
  EXPECT_EQ(origin_status(gate, request, true), 403);
}

TEST(Token, IsTakenFromHeaderQueryOrCookie) {
  const std::string bearer = "Bearer " + token, cookie = "other=1; flowscope_token=" + token;
  EXPECT_EQ(token_status({.method = "GET"}), 401);
  EXPECT_EQ(token_status({.method = "GET", .authorization = bearer}), 200);
  EXPECT_EQ(token_status({.method = "POST", .authorization = bearer}), 200);
  EXPECT_EQ(token_status({.method = "GET", .query_token = token, .has_query_token = true}), 200);
  EXPECT_EQ(token_status({.method = "GET", .cookie = cookie}), 200);
  EXPECT_EQ(token_status({.method = "GET", .cookie = "xflowscope_token=" + token}), 401);
  for (const std::string& wrong : {std::string(), token.substr(1), token + "0", std::string(32, '0')}) {
    const std::string header = "Bearer " + wrong, jar = "flowscope_token=" + wrong;
    EXPECT_EQ(token_status({.method = "GET", .authorization = header, .cookie = cookie}), 401) << wrong;
    EXPECT_EQ(token_status({.method = "GET", .query_token = wrong, .has_query_token = true}), 401) << wrong;
    EXPECT_EQ(token_status({.method = "GET", .cookie = jar}), 401) << wrong;
  }
  EXPECT_EQ(token_status({.method = "GET", .authorization = "Basic " + token}), 401);
}

TEST(Token, ACookieAloneChangesNothing) {
  const std::string cookie = "flowscope_token=" + token;
  EXPECT_EQ(token_status({.method = "POST", .cookie = cookie}), 401);
  EXPECT_EQ(token_status({.method = "DELETE", .fetch_site = "none", .cookie = cookie}), 401);
  EXPECT_EQ(token_status({.method = "POST", .fetch_site = "same-origin", .cookie = cookie}), 200);
  EXPECT_EQ(
      token_status({.method = "PUT", .origin = "http://localhost", .cookie = cookie, .has_origin = true}),
      200);
}

TEST(BodyType, MustBeJson) {
  const Gate gate("127.0.0.1", token);
  const auto check = [&](const char* type) {
    gate.check_body_type({.content_type = type, .has_body = true});
  };
  EXPECT_NO_THROW(check("application/json"));
  EXPECT_NO_THROW(check("Application/JSON ; charset=utf-8"));
  EXPECT_NO_THROW(gate.check_body_type({.has_body = false}));
  for (const char* type :
       {"", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x",
        "application/jsonx", "text/plain; application/json"})
    EXPECT_THROW(check(type), ApiError) << type;
}

}  // namespace
}  // namespace flowscope::web
