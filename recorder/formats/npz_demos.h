// Demonstrations in one NPZ file: arrays demo_<i>/<name> (demo_arrays.h), and `demos`, their number.
#pragma once

#include "recorder/demo.h"
#include "recorder/formats/npz_file.h"

namespace flowscope {

class NpzDemoWriter {
 public:
  explicit NpzDemoWriter(const std::filesystem::path& file) : file_(file) {}
  /// Throws std::invalid_argument (see arrays_of), or std::runtime_error that names the file and the array.
  void add(const Demo& demo);
  /// The file appears now, once `check` has seen it.
  void finish(const FileCheck& check = {});

 private:
  NpzWriter file_;
  std::int64_t count_ = 0;
};

/// Throws std::runtime_error naming the file and the place.
class NpzDemoReader {
 public:
  explicit NpzDemoReader(const std::filesystem::path& file);
  int count() const { return count_; }
  Demo read(int index) const;

 private:
  std::filesystem::path path_;
  NpzReader file_;
  int count_ = 0;
};

}  // namespace flowscope
