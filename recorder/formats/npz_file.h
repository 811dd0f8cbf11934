// NPZ: a zip archive of .npy files, as numpy.savez_compressed writes it; read by numpy without pickles.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "recorder/formats/named_array.h"
#include "render/new_file.h"

namespace flowscope {

/// Writes array after array, each compressed. A text becomes a bytes scalar (dtype S). What it throws names
/// the file, which is there after finish() or not at all.
class NpzWriter {
 public:
  explicit NpzWriter(const std::filesystem::path& file);
  ~NpzWriter();
  void add(const NamedArray& array);
  /// `check` gets the finished file before it appears under its name, and throws if it is not whole.
  void finish(const FileCheck& check = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Throws std::runtime_error that names file and array: not an archive, cut short, a checksum that does not
/// match, an array of another type or shape.
class NpzReader {
 public:
  explicit NpzReader(const std::filesystem::path& file);
  ~NpzReader();
  bool has(const std::string& name) const;
  NamedArray read(const std::string& name, const ArraySpec& expected) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope
