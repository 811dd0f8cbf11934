#include "app/doctor_limits.h"

#include <netdb.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <system_error>

namespace flowscope::app {
namespace {

constexpr rlim_t fewest_to_serve = 256;   ///< libraries, logs and some viewers
constexpr rlim_t enough_to_serve = 1024;  ///< as many viewers as a server takes

/// 0, or why nobody can listen there.
int try_to_listen(const addrinfo& where) {
  const int one = 1, file = ::socket(where.ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (file < 0) return errno;
  ::setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);  // as the server does
  const bool free = ::bind(file, where.ai_addr, where.ai_addrlen) == 0 && ::listen(file, 1) == 0;
  const int error = errno;
  ::close(file);
  return free ? 0 : error;
}

std::string advice_for(int error, std::uint16_t port) {
  if (error == EADDRINUSE)
    return "end the program that holds it, or give another: serve --port N; 0 takes a free one";
  if (error == EACCES && port < 1024) return "ports below 1024 are root's: serve --port N";
  return "give an address of this machine: serve --host ADDRESS";
}

}  // namespace

DoctorCheck check_descriptors() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  const bool endless = limit.rlim_cur == RLIM_INFINITY;
  const std::string now = endless ? "no limit" : std::to_string(limit.rlim_cur);
  DoctorCheck check{"open files", endless || limit.rlim_cur >= fewest_to_serve, now + " at most (ulimit -n)",
                    ""};
  if (!endless && limit.rlim_cur < enough_to_serve) {
    const bool may = limit.rlim_max == RLIM_INFINITY || limit.rlim_max >= enough_to_serve;
    check.advice = may ? "ulimit -n 1024 before starting flowscope: each connection takes one"
                       : "the hard limit is " + std::to_string(limit.rlim_max) +
                             ": raise it (limits.conf, LimitNOFILE=, docker --ulimit nofile=1024)";
  }
  return check;
}

DoctorCheck check_port(const std::string& host, std::uint16_t port, bool asked) {
  const std::string place = host + ":" + std::to_string(port);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* first = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &first) != 0) {
    return {"port", !asked, place + ": no such host",
            "give an address of this machine: serve --host ADDRESS"};
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> all(first, ::freeaddrinfo);
  const int error = try_to_listen(*first);
  if (error == 0) return {"port", true, place + " is free", ""};
  const std::string why = error == EADDRINUSE ? "is in use" : std::generic_category().message(error);
  return {"port", !asked, place + ": " + why, advice_for(error, port)};
}

}  // namespace flowscope::app
