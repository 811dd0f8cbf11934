// Who may ask: Host against rebinding, Origin and Sec-Fetch-Site against foreign pages, the token against
// everyone else.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "web/backend.h"

namespace flowscope::web {

/// The headers and parts of the address that decide; absent ones are empty.
struct Credentials {
  std::string_view method = {}, host = {}, origin = {}, fetch_site = {}, fetch_mode = {}, authorization = {};
  std::string_view cookie = {}, content_type = {};
  bool has_origin = false;
  std::string_view query_token = {};
  bool has_query_token = false;
  bool has_body = false;
};

/// localhost, 127.x.x.x or ::1.
bool is_loopback_host(std::string_view host);

class Gate {
 public:
  /// `bound_host` is what the server listens on; an empty token asks nobody for one. `names` are what it is
  /// called besides, by a proxy in front of it say; `base_path` is where the proxy shows it. Throws
  /// std::invalid_argument for a name that is none.
  Gate(std::string bound_host, std::string token, const std::vector<std::string>& names = {},
       std::string base_path = {});
  /// Two servers of one host would overwrite each other's cookie: from now on its name holds the port.
  void serve_on(std::uint16_t port);

  /// Throws ApiError 403 unless Host names this machine and no foreign page is behind the request. `page` is
  /// the address of the page itself, which a link on a foreign page may open.
  void check_origin(const Credentials& request, bool page) const;
  /// Throws ApiError 401. The cookie alone changes nothing unless the browser says that our own page asked.
  void check_token(const Credentials& request) const;
  /// Throws ApiError 415 for a body that is not JSON: a foreign form cannot send that type.
  void check_body_type(const Credentials& request) const;

  bool is_token(std::string_view candidate) const;  ///< compares in constant time
  /// The Set-Cookie value. Without a base path it names none: the browser takes the folder in which it sees
  /// the page.
  std::string cookie() const;
  const std::string& cookie_name() const { return cookie_name_; }
  bool asks_for_token() const { return !token_.empty(); }

 private:
  bool host_is_ours(std::string_view host) const;
  bool origin_is_ours(std::string_view origin, std::string_view host) const;
  bool is_given_name(const std::string& name) const;
  std::string bound_host_, machine_, token_, base_path_, cookie_name_ = "flowscope_token";
  std::vector<std::string> names_;
  bool everywhere_;  ///< bound to all addresses
};

}  // namespace flowscope::web
