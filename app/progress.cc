#include "app/progress.h"

#include <unistd.h>

#include <cstdio>

namespace flowscope::app {

Progress::Progress(std::string what, int total)
    : what_(std::move(what)), total_(total), terminal_(::isatty(STDERR_FILENO) == 1) {
  if (terminal_) draw_bar(0);
}

Progress::~Progress() {
  if (terminal_) std::fputs("\n", stderr);
}

void Progress::report(int done, const std::string& line) {
  if (terminal_) {
    std::fprintf(stderr, "\r\033[K%s\n", line.c_str());
    draw_bar(done);
  } else {
    std::fprintf(stderr, "%s %d/%d: %s\n", what_.c_str(), done, total_, line.c_str());
  }
}

void Progress::draw_bar(int done) const {
  constexpr int width = 30;
  const int filled = total_ > 0 ? width * done / total_ : 0;
  const std::string bar = std::string(filled, '#') + std::string(width - filled, '.');
  std::fprintf(stderr, "%s [%s] %d/%d", what_.c_str(), bar.c_str(), done, total_);
  std::fflush(stderr);
}

}  // namespace flowscope::app
