#include "web/security.h"

#include <arpa/inet.h>
#include <openssl/crypto.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace flowscope::web {

namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

struct HostAndPort {
  std::string
      name;  ///< in lower case, an IPv6 address without brackets; empty when the text is not `name[:port]`
  std::string port;  ///< digits; may be empty
};

HostAndPort host_and_port(std::string_view host) {
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
    port = digits;
  }
  return {lower(name), std::string(port)};
}

std::string host_name(std::string_view host) { return host_and_port(host).name; }

/// Letters, digits, - . _ and the colons of IPv6: what may be a name, and may be repeated in a message.
bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() <= 253 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == '_' || c == ':';
  });
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

/// Whether any cookie of that name holds what `is_right` asks for: an old one of another path may come along.
template <typename Right>
bool has_cookie(std::string_view cookies, std::string_view wanted, Right is_right) {
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    std::string_view item = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    while (item.starts_with(' ')) item.remove_prefix(1);
    const std::size_t equals = item.find('=');
    if (equals != item.npos && item.substr(0, equals) == wanted && is_right(item.substr(equals + 1)))
      return true;
  }
  return false;
}

bool changes_something(std::string_view method) { return method != "GET" && method != "HEAD"; }

}  // namespace

bool is_loopback_host(std::string_view host) {
  const std::string name = lower(host);
  return name == "localhost" || address_kind(name) == Address::loopback;
}

Gate::Gate(std::string bound_host, std::string token, const std::vector<std::string>& names,
           std::string base_path)
    : bound_host_(lower(bound_host)),
      token_(std::move(token)),
      base_path_(std::move(base_path)),
      everywhere_(address_kind(bound_host_) == Address::any) {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) == 0) machine_ = lower(name.data());
  for (const std::string& given : names) {
    const bool bare_v6 = address_kind(lower(given)) != Address::none && given.find(':') != given.npos;
    const HostAndPort host = bare_v6 ? HostAndPort{lower(given), {}} : host_and_port(given);
    if (!is_plain_name(host.name) || !host.port.empty() || address_kind(host.name) == Address::any)
      throw std::invalid_argument(
          "'" + given + "' is no host name; give one as in robot.example.com, without http:// and port");
    names_.push_back(host.name);
  }
}

void Gate::serve_on(std::uint16_t port) { cookie_name_ = "flowscope_token_" + std::to_string(port); }

bool Gate::is_given_name(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

bool Gate::host_is_ours(std::string_view host) const {
  const std::string name = host_name(host);
  const Address kind = address_kind(name);
  if (name.empty() || kind == Address::any) return false;
  if (name == "localhost" || kind == Address::loopback || name == bound_host_ || is_given_name(name))
    return true;
  // Bound to every address: a foreign page cannot make the browser send a number or this machine's name as
  // Host.
  return everywhere_ && (kind == Address::other || name == machine_);
}

/// Our own page's. Under a name that we were given, a proxy may add TLS, a port of its own, or put an address
/// of ours into Host; a page of another port of that name is a stranger's all the same.
bool Gate::origin_is_ours(std::string_view origin, std::string_view host) const {
  const std::string page = lower(origin), asked = lower(host);
  if (page == "http://" + asked) return true;
  const bool secure = page.starts_with("https://");
  if (!secure && !page.starts_with("http://")) return false;
  const HostAndPort from = host_and_port(std::string_view(page).substr(secure ? 8 : 7)),
                    to = host_and_port(asked);
  if (!is_given_name(from.name)) return false;
  const std::string usual = secure ? "443" : "80";
  return from.name != to.name || to.port.empty() || to.port == (from.port.empty() ? usual : from.port);
}

void Gate::check_origin(const Credentials& request, bool page) const {
  const auto advice = [](const std::string& name) {
    return is_plain_name(name) ? "; if that is a name of this server, start it with --allow-host " + name
                               : std::string();
  };
  if (!host_is_ours(request.host)) {
    const std::string name = host_name(request.host);
    throw ApiError(403, "foreign_host",
                   "this server is not called " + (is_plain_name(name) ? name : std::string("that")) +
                       "; use the address that it printed" + advice(name),
                   "Host");
  }
  if (request.has_origin && !origin_is_ours(request.origin, request.host)) {
    const std::size_t scheme = request.origin.find("://");
    const std::string name =
        scheme == std::string_view::npos ? "" : host_name(request.origin.substr(scheme + 3));
    throw ApiError(403, "foreign_origin", "asked for by a foreign page" + advice(name), "Origin");
  }
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
                         "the token is missing or wrong; it is in the address that was printed",
                         "Authorization");
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
  if (!has_cookie(request.cookie, cookie_name_, [this](std::string_view value) { return is_token(value); }))
    throw refused;
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
  const std::string path = base_path_.empty() ? "" : "; Path=" + base_path_ + "/";
  return cookie_name_ + "=" + token_ + "; HttpOnly; SameSite=Strict" + path;
}

}  // namespace flowscope::web
