#include "web/address.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/served_fake.h"

namespace flowscope::web {
namespace {

using testing::ServedFake;

TEST(Address, TheBasePathMayBeCutOffOrNot) {
  EXPECT_EQ(read_address("/api/v1/state", "").path, "/api/v1/state");
  for (const char* target : {"/api/v1/state", "/lab/proxy/8080/api/v1/state"})
    EXPECT_EQ(read_address(target, "/lab/proxy/8080").path, "/api/v1/state") << target;
  EXPECT_TRUE(read_address("/lab/", "/lab").page);
  EXPECT_EQ(read_address("/lab?token=t", "/lab").path, "");
  EXPECT_EQ(read_address("/labs/x", "/lab").path, "/labs/x");
}

TEST(Address, ActionsAreReadAsTheirUsersTypeThem) {
  for (const char* target :
       {"/?action=stream", "/?action=stream?dummy=param.mjpg", "/?action=stream&dummy=param.mjpg",
        "/?x=1&action=stream?y", "/?action=stream%3Fdummy=param.mjpg", "/lab/?action=stream?dummy=a.mjpg"})
    EXPECT_EQ(read_address(target, "/lab").path, "/stream") << target;
  const Address late = read_address("/?action=snapshot?token=t&view=main", "");
  EXPECT_EQ(late.path, "/snapshot");
  EXPECT_EQ(late.query.get("token"), "t");
  EXPECT_EQ(late.query.get("view"), "main");
  EXPECT_EQ(read_address("/?tab=a?b", "").query.get("tab"), "a?b");
  for (const char* target :
       {"/?action=dance", "/?action=", "/?action", "/?action=streams", "/?action=stream/"}) {
    EXPECT_EQ(read_address(target, "").path, "/") << target;
    EXPECT_FALSE(read_address(target, "").page) << target;
  }
}

TEST(Address, BasePathsArePlain) {
  EXPECT_EQ(checked_base_path(""), "");
  EXPECT_EQ(checked_base_path("/"), "");
  EXPECT_EQ(checked_base_path("/proxy/8080/"), "/proxy/8080");
  EXPECT_EQ(checked_base_path("user/anna/proxy"), "/user/anna/proxy");
  for (const char* text : {"/a b", "/a?b", "/../x", "/a//b", "http://host/x", "/a;b", "/a\r\nb"})
    EXPECT_THROW(checked_base_path(text), std::invalid_argument) << text;
}

TEST(Actions, UnknownOnesAreRefused) {
  const ServedFake served;
  for (const char* target : {"/?action=dance", "/?action=", "/?action=stream_9"}) {
    const testing::Reply reply = served.get(target);
    EXPECT_EQ(reply.status, 400) << target;
    EXPECT_NE(reply.body.find("\"where\":\"action\""), std::string::npos) << reply.body;
  }
  EXPECT_EQ(testing::call(served.server.port(), "GET", "/?action=dance").status, 401);
  EXPECT_EQ(served.get("/?action=snapshot?dummy=1.jpg").headers.at("content-type"), "image/jpeg");
}

TEST(BehindAProxy, ThePageIsFoundWhereverItIsShown) {
  ServerOptions options;
  options.names = {"hub.example.com"};
  options.base_path = "/user/anna/proxy/8080";
  const ServedFake served(options);
  const std::uint16_t port = served.server.port();
  EXPECT_EQ(served.server.url(), "http://127.0.0.1:" + std::to_string(port) +
                                     "/user/anna/proxy/8080/?token=" + testing::test_token);
  const testing::Headers outside{{"Host", "hub.example.com"}};
  for (const std::string& prefix : {std::string(), options.base_path}) {
    const testing::Reply welcome =
        testing::call(port, "GET", prefix + "/?token=" + testing::test_token, outside);
    EXPECT_EQ(welcome.status, 303);
    EXPECT_EQ(welcome.headers.at("location"), "./") << "relative: holds with and without the prefix";
    const std::string cookie = welcome.headers.at("set-cookie");
    EXPECT_NE(cookie.find("Path=/user/anna/proxy/8080/"), std::string::npos) << cookie;
    EXPECT_TRUE(cookie.starts_with("flowscope_token_" + std::to_string(port) + "=")) << cookie;
    const testing::Reply state = testing::call(port, "GET", prefix + "/api/v1/state",
                                               {{"Host", "hub.example.com"},
                                                {"Origin", "https://hub.example.com"},
                                                {"Cookie", cookie.substr(0, cookie.find(';'))}});
    EXPECT_EQ(state.status, 200) << state.body;
  }
  const testing::Reply bare = testing::call(port, "GET", "/user/anna/proxy/8080?token=t", outside);
  EXPECT_EQ(bare.status, 303);
  EXPECT_EQ(bare.headers.at("location"), "8080/?token=t");
}

TEST(BehindAProxy, WithoutABasePathTheBrowserChoosesTheCookiesPath) {
  const ServedFake served;
  const testing::Reply welcome = testing::call(served.server.port(), "GET", "/?token=" + testing::test_token);
  EXPECT_EQ(welcome.headers.at("set-cookie").find("Path="), std::string::npos);
}

}  // namespace
}  // namespace flowscope::web
