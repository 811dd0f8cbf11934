// The real server on a free port over a fake program.
#pragma once

#include "tests/support/fake_backend.h"
#include "tests/support/http_client.h"
#include "web/server.h"

namespace flowscope::testing {

inline const std::string test_token = "0123456789abcdef0123456789abcdef";

struct ServedFake {
  explicit ServedFake(web::ServerOptions options = {}, bool with_token = true)
      : server(prepared(std::move(options), with_token), backend) {
    backend.on_event = [this](web::Event event) { server.send(std::move(event)); };
  }
  ~ServedFake() {
    backend.on_event = [](web::Event) {};
  }
  Reply get(const std::string& target, Headers headers = {}) const {
    return with_token("GET", target, headers);
  }
  Reply send(const std::string& method, const std::string& target, const std::string& body = {},
             Headers headers = {}) const {
    if (!body.empty()) headers.emplace_back("Content-Type", "application/json");
    return with_token(method, target, headers, body);
  }
  Reply with_token(const std::string& method, const std::string& target, Headers headers,
                   const std::string& body = {}) const {
    headers.emplace_back("Authorization", "Bearer " + test_token);
    return call(server.port(), method, target, headers, body);
  }

  FakeBackend backend;
  web::Server server;

 private:
  static web::ServerOptions prepared(web::ServerOptions options, bool with_token) {
    options.port = 0;
    if (with_token) options.token = test_token;
    return options;
  }
};

}  // namespace flowscope::testing
