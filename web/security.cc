#include "web/security.h"

#include <arpa/inet.h>
#include <openssl/crypto.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <optional>

namespace flowscope::web {

namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

/// The name of `name[:port]` in lower case; empty when it is not that form.
std::string host_name(std::string_view host) {
  std::string_view name = host, port;
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == host.npos) return {};
    name = host.substr(1, end - 1);
    port = host.substr(end + 1);
    if (name.find(':') == name.npos) return {};
  } else if (const std::size_t colon = host.find(':'); colon != host.npos) {
    name = host.substr(0, colon);
    port = host.substr(colon);
  }
  if (!port.empty()) {
    const std::string_view digits = port.substr(1);
    const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
    if (port.front() != ':' || digits.empty() || digits.size() > 5 ||
        !std::all_of(digits.begin(), digits.end(), is_digit))
      return {};
  }
  return lower(name);
}

enum class Address { none, loopback, any, other };

/// Strict dotted quads and IPv6 only: 0x7f.1 and 2130706433 are names to us, and no names of ours.
Address address_kind(const std::string& name) {
  in_addr v4{};
  if (inet_pton(AF_INET, name.c_str(), &v4) == 1) {
    const std::uint32_t bits = ntohl(v4.s_addr);
    if (bits == 0) return Address::any;
    return bits >> 24 == 127 ? Address::loopback : Address::other;
  }
  in6_addr v6{};
  if (inet_pton(AF_INET6, name.c_str(), &v6) == 1) {
    if (IN6_IS_ADDR_UNSPECIFIED(&v6)) return Address::any;
    return IN6_IS_ADDR_LOOPBACK(&v6) ? Address::loopback : Address::other;
  }
  return Address::none;
}

std::optional<std::string_view> cookie_value(std::string_view cookies, std::string_view wanted) {
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    std::string_view item = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    while (item.starts_with(' ')) item.remove_prefix(1);
    const std::size_t equals = item.find('=');
    if (equals != item.npos && item.substr(0, equals) == wanted) return item.substr(equals + 1);
  }
  return std::nullopt;
}

constexpr std::string_view cookie_name = "flowscope_token";

bool changes_something(std::string_view method) { return method != "GET" && method != "HEAD"; }

}  // namespace

Gate::Gate(std::string bound_host, std::string token)
    : bound_host_(lower(bound_host)),
      token_(std::move(token)),
      everywhere_(address_kind(bound_host_) == Address::any) {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) == 0) machine_ = lower(name.data());
}

bool Gate::host_is_ours(std::string_view host) const {
  const std::string name = host_name(host);
  const Address kind = address_kind(name);
  if (name.empty() || kind == Address::any) return false;
  if (name == "localhost" || kind == Address::loopback || name == bound_host_) return true;
  // Bound to every address: a foreign page cannot make the browser send a number or this machine's name as
  // Host.
  return everywhere_ && (kind == Address::other || name == machine_);
}

void Gate::check_origin(const Credentials& request, bool page) const {
  if (!host_is_ours(request.host))
    throw ApiError(403, "foreign_host", "this server is not called that; use the address that it printed",
                   "Host");
  const bool same = lower(request.origin) == "http://" + lower(request.host);
  if (request.has_origin && !same)
    throw ApiError(403, "foreign_origin", "asked for by a foreign page", "Origin");
  const std::string_view site = request.fetch_site;
  const bool foreign = !site.empty() && site != "same-origin" && site != "none";
  const bool opens_page = page && request.fetch_mode == "navigate" && !changes_something(request.method);
  if (foreign && !opens_page)
    throw ApiError(403, "foreign_origin", "asked for by a foreign page", "Sec-Fetch-Site");
}

bool Gate::is_token(std::string_view candidate) const {
  return candidate.size() == token_.size() &&
         CRYPTO_memcmp(candidate.data(), token_.data(), token_.size()) == 0;
}

void Gate::check_token(const Credentials& request) const {
  if (token_.empty()) {
    // Nothing to prove; yet a browser's own word keeps foreign pages out (checked above).
    return;
  }
  const ApiError refused(401, "unauthorized",
                         "the token is missing or wrong; it is in the address that was printed");
  if (!request.authorization.empty()) {
    constexpr std::string_view scheme = "bearer ";
    if (lower(request.authorization.substr(0, scheme.size())) != scheme ||
        !is_token(request.authorization.substr(scheme.size())))
      throw refused;
    return;
  }
  if (request.has_query_token) {
    if (!is_token(request.query_token)) throw refused;
    return;
  }
  const auto cookie = cookie_value(request.cookie, cookie_name);
  if (!cookie || !is_token(*cookie)) throw refused;
  const bool our_page =
      request.has_origin || request.fetch_site == "same-origin";  // foreign ones are gone by now
  if (changes_something(request.method) && !our_page)
    throw ApiError(401, "unauthorized", "a cookie alone changes nothing; send Authorization: Bearer",
                   "Cookie");
}

void Gate::check_body_type(const Credentials& request) const {
  if (!request.has_body) return;
  const std::string type = lower(request.content_type.substr(0, request.content_type.find(';')));
  const std::size_t end = type.find_last_not_of(' ');
  if (end == std::string::npos || type.substr(0, end + 1) != "application/json")
    throw ApiError(415, "not_json", "send the body as application/json", "Content-Type");
}

std::string Gate::cookie() const {
  return std::string(cookie_name) + "=" + token_ + "; HttpOnly; SameSite=Strict; Path=/";
}

}  // namespace flowscope::web
