// Who may ask: Host against rebinding, Origin and Sec-Fetch-Site against foreign pages, the token against
// everyone else.
#pragma once

#include <string>
#include <string_view>

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

class Gate {
 public:
  /// `bound_host` is what the server listens on; an empty token asks nobody for one.
  Gate(std::string bound_host, std::string token);

  /// Throws ApiError 403 unless Host names this machine and no foreign page is behind the request. `page` is
  /// the address of the page itself, which a link on a foreign page may open.
  void check_origin(const Credentials& request, bool page) const;
  /// Throws ApiError 401. The cookie alone changes nothing unless the browser says that our own page asked.
  void check_token(const Credentials& request) const;
  /// Throws ApiError 415 for a body that is not JSON: a foreign form cannot send that type.
  void check_body_type(const Credentials& request) const;

  bool is_token(std::string_view candidate) const;  ///< compares in constant time
  std::string cookie() const;                       ///< the Set-Cookie value
  bool asks_for_token() const { return !token_.empty(); }

 private:
  bool host_is_ours(std::string_view host) const;
  std::string bound_host_, machine_, token_;
  bool everywhere_;  ///< bound to all addresses
};

}  // namespace flowscope::web
