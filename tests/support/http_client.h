// A blocking client that sends exactly the bytes it is told to, and reads what comes back.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace flowscope::testing {

struct Reply {
  int status = 0;                              ///< 0: the connection closed without an answer
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
};

/// One TCP connection to this machine. Reads give up after ten seconds.
class Connection {
 public:
  explicit Connection(std::uint16_t port, int receive_buffer = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const timeval patience{10, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (receive_buffer) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("cannot connect");
  }
  ~Connection() { ::close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send(const std::string& bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const auto n = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) return;  // the server may refuse before it has read everything
      sent += static_cast<std::size_t>(n);
    }
  }
  /// False at the end of the stream, or when nothing came in time.
  bool fill() {
    char block[16384];
    const auto n = ::recv(socket_, block, sizeof block, 0);
    if (n <= 0) return false;
    pending_.append(block, static_cast<std::size_t>(n));
    return true;
  }
  /// Up to and with `end`; what there is when the stream ends.
  std::string until(const std::string& end) {
    std::size_t at = 0;
    while ((at = pending_.find(end)) == std::string::npos)
      if (!fill()) return std::exchange(pending_, {});
    return take(at + end.size());
  }
  std::string exactly(std::size_t size) {
    while (pending_.size() < size)
      if (!fill()) break;
    return take(std::min(size, pending_.size()));
  }
  std::string rest() {
    while (fill()) {
    }
    return std::exchange(pending_, {});
  }
  Reply reply(bool head_only = false) {
    Reply reply;
    const std::string head = until("\r\n\r\n");
    if (!head.starts_with("HTTP/1.1 ")) return reply;
    reply.status = std::atoi(head.c_str() + 9);
    reply.headers = parse_headers(head.substr(head.find("\r\n") + 2));
    if (!head_only && reply.headers.contains("content-length"))
      reply.body = exactly(std::stoul(reply.headers["content-length"]));
    return reply;
  }
  static std::map<std::string, std::string> parse_headers(std::string text) {
    std::map<std::string, std::string> headers;
    for (std::size_t end = text.find("\r\n"); end != std::string::npos && end > 0; end = text.find("\r\n")) {
      const std::string line = text.substr(0, end);
      text.erase(0, end + 2);
      const std::size_t colon = line.find(": ");
      if (colon == std::string::npos) continue;
      std::string name = line.substr(0, colon);
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      headers[name] = line.substr(colon + 2);
    }
    return headers;
  }

 private:
  std::string take(std::size_t size) {
    std::string taken = pending_.substr(0, size);
    pending_.erase(0, size);
    return taken;
  }
  int socket_;
  std::string pending_;
};

using Headers = std::vector<std::pair<std::string, std::string>>;

inline std::string request_text(const std::string& method, const std::string& target,
                                const Headers& headers = {}, const std::string& body = {}) {
  std::string text = method + " " + target + " HTTP/1.1\r\n";
  bool has_host = false;
  for (const auto& [name, value] : headers) {
    text += name + ": " + value + "\r\n";
    has_host = has_host || name == "Host";
  }
  if (!has_host) text += "Host: localhost\r\n";
  if (!body.empty()) text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  return text + "\r\n" + body;
}

inline Reply call(std::uint16_t port, const std::string& method, const std::string& target,
                  const Headers& headers = {}, const std::string& body = {}) {
  Connection connection(port);
  connection.send(request_text(method, target, headers, body));
  return connection.reply(method == "HEAD");
}

}  // namespace flowscope::testing
