#include "web/openapi.h"

#include <nlohmann/json.hpp>

namespace flowscope::web {

using wire::Json;

namespace {

Json reference(const std::string& name) { return {{"$ref", "#/components/schemas/" + name}}; }

Json content(const std::string& type, Json schema) { return {{type, {{"schema", std::move(schema)}}}}; }

Json parameters(const Route& route) {
  Json list = Json::array();
  std::string_view rest = route.pattern;
  for (std::size_t open = rest.find('{'); open != rest.npos; open = rest.find('{')) {
    const std::size_t close = rest.find('}');
    list.push_back({{"name", rest.substr(open + 1, close - open - 1)},
                    {"in", "path"},
                    {"required", true},
                    {"schema", {{"type", "string"}}}});
    rest.remove_prefix(close + 1);
  }
  for (const QueryField& field : route.query)
    list.push_back({{"name", field.name}, {"in", "query"}, {"schema", Json::parse(field.schema)}});
  return list;
}

Json success(const Route& route) {
  Json answer{{"description", route.summary}};
  const bool is_type = route.response.find('/') != std::string::npos;
  if (is_type) answer["content"] = content(route.response, {{"type", "string"}});
  if (!is_type && !route.response.empty())
    answer["content"] = content("application/json", reference(route.response));
  return answer;
}

Json operation(const Route& route) {
  Json json{{"summary", route.summary}, {"parameters", parameters(route)}};
  if (!route.request.empty())
    json["requestBody"] = {{"content", content("application/json", Json::parse(route.request))}};
  const std::string status = route.lane == Lane::events ? "101" : std::to_string(route.success);
  json["responses"] = {
      {status, success(route)},
      {"default",
       {{"description", "it did not work"}, {"content", content("application/json", reference("Error"))}}}};
  if (route.open) json["security"] = Json::array();
  return json;
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

Json openapi(const std::vector<Route>& routes, const std::string& cookie) {
  Json paths = Json::object();
  for (const Route& route : routes) paths[route.pattern][lower(route.method)] = operation(route);
  const Json empty = Json::array();
  return {
      {"openapi", "3.1.0"},
      {"info",
       {{"title", "flowscope"},
        {"version", "1"},
        {"description",
         "Metres, radians and seconds unless a name says otherwise; world frame, z up; quaternions w,x,y,z; "
         "openness 1 open, 0 closed; flow time 0 noise, 1 action."}}},
      {"security", Json::array({Json{{"bearer", empty}}, Json{{"query", empty}}, Json{{"cookie", empty}}})},
      {"paths", std::move(paths)},
      {"components",
       {{"schemas", openapi_schemas()},
        {"securitySchemes",
         {{"bearer", {{"type", "http"}, {"scheme", "bearer"}}},
          {"query", {{"type", "apiKey"}, {"in", "query"}, {"name", "token"}}},
          {"cookie", {{"type", "apiKey"}, {"in", "cookie"}, {"name", cookie}}}}}}}};
}

}  // namespace flowscope::web
