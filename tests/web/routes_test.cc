#include "web/routes.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/served_fake.h"
#include "web/openapi.h"

namespace flowscope::web {
namespace {

using testing::ServedFake;
using wire::Json;

std::vector<Route> all_routes(Backend& backend) {
  return make_routes(backend, {[] { return std::string(); }, [] { return std::string(); }});
}

/// An address that the route matches and that the fake program knows.
std::string example(const Route& route) {
  std::string target = route.pattern;
  const auto put = [&](const std::string& name, const std::string& value) {
    if (const auto at = target.find(name); at != std::string::npos) target.replace(at, name.size(), value);
  };
  const bool view = target.find("/views/") != std::string::npos,
             demo = target.find("/demos/") != std::string::npos;
  put("{id}", view ? "main" : demo ? "push_buttons-0001" : "t1");
  put("{name}", "push_buttons");
  put("{file}", "figure-1.png");
  return target;
}

/// Only the head: streams have no end.
int status(const ServedFake& served, const Route& route, const std::string& target,
           testing::Headers headers) {
  std::string body;
  if (!route.request.empty()) {
    headers.emplace_back("Content-Type", "application/json");
    body = "{\"nothing\":0}";
  }
  testing::Connection connection(served.server.port());
  connection.send(testing::request_text(route.method, target, headers, body));
  return connection.reply(true).status;
}

TEST(Routes, EveryOneButHealthAsksForTheToken) {
  const ServedFake served;
  testing::FakeBackend backend;
  int checked = 0;
  for (const Route& route : all_routes(backend)) {
    const std::string target = example(route), name = route.method + " " + route.pattern;
    const bool open = route.pattern == "/health";
    EXPECT_EQ(route.open, open) << name;
    EXPECT_EQ(status(served, route, target, {}) == 401, !open) << name;
    EXPECT_EQ(status(served, route, target, {{"Authorization", "Bearer wrong"}}) == 401, !open) << name;
    EXPECT_EQ(status(served, route, target + "?token=wrong", {}) == 401, !open) << name;
    const int known = status(served, route, target, {{"Authorization", "Bearer " + testing::test_token}});
    EXPECT_TRUE(known != 401 && known != 403 && known != 0 && known < 500) << name << " " << known;
    EXPECT_EQ(status(served, route, target, {{"Host", "evil.com"}}), 403) << name;
    ++checked;
  }
  EXPECT_GT(checked, 25);
}

TEST(Routes, AForeignPageChangesNothing) {
  const ServedFake served;
  testing::FakeBackend backend;
  for (const Route& route : all_routes(backend)) {
    const std::string target = example(route) + "?token=" + testing::test_token;
    EXPECT_EQ(status(served, route, target, {{"Origin", "http://evil.com"}}), 403) << route.pattern;
    EXPECT_EQ(status(served, route, target, {{"Sec-Fetch-Site", "cross-site"}}), 403) << route.pattern;
  }
}

TEST(Routes, EveryBodyIsReadAndEveryRefusalNamesItsPlace) {
  const ServedFake served;
  testing::FakeBackend backend;
  const auto expect_place = [](const testing::Reply& reply, const std::string& what) {
    EXPECT_TRUE(reply.status >= 400 && reply.status < 500) << what << " " << reply.status;
    const Json error = Json::parse(reply.body)["error"];
    EXPECT_TRUE(error.contains("where") && !error["where"].get<std::string>().empty())
        << what << " " << reply.body;
  };
  int bodies = 0;
  for (const Route& route : all_routes(backend)) {
    const std::string name = route.method + " " + route.pattern;
    if (!route.open)
      expect_place(testing::call(served.server.port(), route.method, example(route)),
                   name + " without token");
    if (route.pattern.find("{id}") != std::string::npos && route.request.empty())
      expect_place(served.send(route.method, route.pattern.substr(0, route.pattern.find('{')) + "nobody" +
                                                 route.pattern.substr(route.pattern.find('}') + 1)),
                   name + " of nobody");
    if (route.request.empty()) continue;
    ++bodies;
    for (const char* text : {"{", "no JSON", "[]", "{\"nothing\":0}", "7"})
      expect_place(served.send(route.method, example(route), text), name + " " + text);
  }
  EXPECT_GT(bodies, 12);
  expect_place(served.send("POST", "/api/v1/train", R"({"action":"stop"})"), "409");
  expect_place(served.get("/api/v1/nothing"), "404");
  expect_place(served.send("PATCH", "/api/v1/state"), "405");
}

TEST(OpenApi, ListsExactlyTheRouteTable) {
  const ServedFake served;
  const Json document = Json::parse(served.get("/api/v1/openapi.json").body);
  std::set<std::string> listed, expected;
  for (const auto& [path, operations] : document["paths"].items())
    for (const auto& [method, operation] : operations.items()) listed.insert(method + " " + path);
  testing::FakeBackend backend;
  for (const Route& route : all_routes(backend)) {
    std::string method = route.method;
    for (char& c : method) c = static_cast<char>(std::tolower(c));
    expected.insert(method + " " + route.pattern);
  }
  EXPECT_EQ(listed, expected);
}

TEST(OpenApi, EveryReferenceLeadsSomewhere) {
  testing::FakeBackend backend;
  const Json document = openapi(all_routes(backend));
  const std::string text = wire::dump(document), prefix = "#/components/schemas/";
  int references = 0;
  for (std::size_t at = text.find(prefix); at != std::string::npos; at = text.find(prefix, at + 1)) {
    const std::string name = text.substr(at + prefix.size(), text.find('"', at) - at - prefix.size());
    EXPECT_TRUE(document["components"]["schemas"].contains(name)) << name;
    ++references;
  }
  EXPECT_GT(references, 40);
}

/// Every required key is there, and every key that is there is described.
void expect_described(const Json& value, const Json& schema, const Json& schemas, const std::string& place) {
  if (schema.contains("$ref")) {
    const std::string name = schema["$ref"].get<std::string>().substr(21);
    return expect_described(value, schemas[name], schemas, place + ":" + name);
  }
  if (value.is_array() && schema.contains("items"))
    for (const Json& item : value) expect_described(item, schema["items"], schemas, place + "[]");
  if (!value.is_object() || !schema.contains("properties")) return;
  if (schema.contains("required")) {
    for (const Json& key : schema["required"]) {
      EXPECT_TRUE(value.contains(key.get<std::string>())) << place << "." << key;
    }
  }
  for (const auto& [key, item] : value.items()) {
    ASSERT_TRUE(schema["properties"].contains(key)) << place << "." << key;
    expect_described(item, schema["properties"][key], schemas, place + "." + key);
  }
}

TEST(OpenApi, AnswersFitTheirSchemas) {
  const ServedFake served;
  served.send("POST", "/api/v1/script", R"({"record":true})");
  const Json document = Json::parse(served.get("/api/v1/openapi.json").body);
  testing::FakeBackend backend;
  int checked = 0;
  for (const Route& route : all_routes(backend)) {
    if (route.method != "GET" || route.response.find('/') != std::string::npos || route.lane == Lane::events)
      continue;
    const std::string target = route.pattern == "/api/v1/jobs/{id}" ? "/api/v1/jobs/j1" : example(route);
    const testing::Reply reply = served.get(target);
    ASSERT_EQ(reply.status, 200) << target;
    const Json& schemas = document["components"]["schemas"];
    expect_described(Json::parse(reply.body), schemas[route.response], schemas, route.response);
    ++checked;
  }
  EXPECT_GE(checked, 11);
}

TEST(Routes, CarryAWholeSession) {
  const ServedFake served;
  const auto json = [](const testing::Reply& reply) { return Json::parse(reply.body); };
  EXPECT_EQ(
      json(served.send("POST", "/api/v1/reset", R"({"task":"open_drawer","variation":1,"seed":5})"))["seed"],
      5);
  EXPECT_EQ(served.send("POST", "/api/v1/reset", R"({"task":"no_such"})").status, 404);
  EXPECT_EQ(json(served.send("PUT", "/api/v1/views/main", R"({"camera":"wrist"})"))["camera"], "wrist");
  EXPECT_EQ(served.send("PUT", "/api/v1/views/main", R"({"camera":"nose"})").status, 400);
  EXPECT_TRUE(
      json(served.send("POST", "/api/v1/views/main/drag", R"({"action":"rotate","dx":0.1})"))["camera"]
          .is_null());
  EXPECT_EQ(served.get("/api/v1/tasks/push_buttons/script").body.substr(0, 18), "task: push_buttons");

  const testing::Reply started =
      served.send("POST", "/api/v1/script", R"({"task":"open_drawer","record":true})");
  EXPECT_EQ(started.status, 202);
  const std::string job = json(started)["job"];
  EXPECT_EQ(json(served.get("/api/v1/jobs/" + job))["state"], "running");
  EXPECT_EQ(json(served.send("DELETE", "/api/v1/jobs/" + job))["state"], "cancelled");

  EXPECT_EQ(json(served.send("POST", "/api/v1/train", R"({"action":"start","minutes":1})"))["running"], true);
  EXPECT_EQ(json(served.get("/api/v1/state"))["training"], true);

  const Json traces =
      json(served.send("POST", "/api/v1/predict", R"({"flow_steps":8,"seed":3,"samples":2})"))["traces"];
  ASSERT_EQ(traces.size(), 2u);
  const std::string trace = "/api/v1/traces/" + traces[0].get<std::string>();
  EXPECT_EQ(json(served.get(trace))["steps"].size(), 9u);
  EXPECT_EQ(json(served.get(trace + "?weights=1"))["steps"][0]["weights"].size(), 64u);
  EXPECT_EQ(served.get(trace + "?weights=2").status, 400);
  EXPECT_EQ(served.send("POST", trace + "/show", R"({"step":3})").status, 204);
  EXPECT_EQ(json(served.get("/api/v1/state"))["shown"]["step"], 3);
  EXPECT_EQ(served.send("POST", trace + "/show", R"({"step":null})").status, 204);
  EXPECT_TRUE(json(served.get("/api/v1/state"))["shown"].is_null());
  const std::string branch =
      json(served.send("POST", trace + "/branch", R"({"step":2,"position":[0.3,0,1]})"))["trace"];
  EXPECT_EQ(json(served.get("/api/v1/traces/" + branch))["parent"]["step"], 2);
  EXPECT_EQ(served.send("POST", trace + "/execute").status, 202) << "no body is needed";
  EXPECT_EQ(served.send("DELETE", trace).status, 204);
  EXPECT_EQ(served.get(trace).status, 404);

  EXPECT_EQ(served.get("/api/v1/demos/push_buttons-0001/picture?keyframe=0&camera=wrist").body.substr(1, 3),
            "PNG");
  EXPECT_EQ(served.send("DELETE", "/api/v1/demos/push_buttons-0001").status, 204);
  EXPECT_EQ(served.get("/api/v1/demos/push_buttons-0001").status, 404);
}

}  // namespace
}  // namespace flowscope::web
