// The real program as a process of its own, to be killed, starved and asked.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace flowscope::testing {

/// Runs until it ends or this goes. Both of its outputs come through one pipe.
class ChildProgram {
 public:
  /// `words` without the program itself; `max_file_bytes` as by set_max_file_bytes, from the first moment on.
  explicit ChildProgram(const std::string& program, std::vector<std::string> words,
                        std::optional<std::uint64_t> max_file_bytes = {}) {
    int pipe[2];
    if (::pipe2(pipe, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    words.insert(words.begin(), program);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(pipe[1], STDOUT_FILENO);
      ::dup2(pipe[1], STDERR_FILENO);
      std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is then an error of a write
      if (max_file_bytes) limit(0, *max_file_bytes);
      ::execv(program.c_str(), arguments.data());
      ::_exit(127);
    }
    ::close(pipe[1]);
    out_ = pipe[0];
  }
  ~ChildProgram() {
    if (pid_ > 0) kill();
    ::close(out_);
  }
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  pid_t pid() const { return pid_; }

  /// The largest file that it may write from now on: beyond that its writes fail, as on a full disk.
  void set_max_file_bytes(std::uint64_t bytes) const { limit(pid_, bytes); }

  void kill() {
    ::kill(pid_, SIGKILL);
    wait();
  }
  /// The exit code; -1 when a signal ended it.
  int wait() {
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  /// Reads until a line holds `part` and returns that line; empty when the output ends before.
  std::string line_with(const std::string& part) {
    for (;;) {
      const std::size_t at = text_.find(part, searched_);
      const std::size_t end = at == std::string::npos ? at : text_.find('\n', at);
      if (end != std::string::npos) {
        const std::size_t begin = text_.rfind('\n', at) == std::string::npos ? 0 : text_.rfind('\n', at) + 1;
        searched_ = end;
        return text_.substr(begin, end - begin);
      }
      if (!fill()) return {};
    }
  }
  /// All that it wrote; waits for the end of its output.
  const std::string& rest() {
    while (fill()) {
    }
    return text_;
  }

 private:
  static void limit(pid_t pid, std::uint64_t bytes) {
    rlimit now{};
    ::prlimit(pid, RLIMIT_FSIZE, nullptr, &now);
    now.rlim_cur = bytes;
    ::prlimit(pid, RLIMIT_FSIZE, &now, nullptr);
  }
  bool fill() {
    char part[4096];
    const ssize_t n = ::read(out_, part, sizeof part);
    if (n <= 0) return false;
    text_.append(part, static_cast<std::size_t>(n));
    return true;
  }

  pid_t pid_ = -1;
  int out_ = -1;
  std::string text_;
  std::size_t searched_ = 0;
};

}  // namespace flowscope::testing
