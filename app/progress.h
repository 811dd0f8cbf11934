// How far long work has come, on stderr: a bar that stays in its line on a terminal, plain lines elsewhere.
#pragma once

#include <string>

namespace flowscope::app {

class Progress {
 public:
  /// `what` names the work; `total` is in its own units.
  Progress(std::string what, int total);
  ~Progress();  ///< ends the bar's line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` of the total, with a line that stays.
  void report(int done, const std::string& line);

 private:
  void draw_bar(int done) const;

  std::string what_;
  int total_;
  bool terminal_;
};

}  // namespace flowscope::app
