// HDF5 files of named arrays, groups and attributes. Not safe from several threads: the library is not.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "recorder/formats/named_array.h"
#include "render/new_file.h"

namespace flowscope {

/// A new file. Groups on the way are made as needed. Arrays are compressed and carry checksums (Fletcher-32);
/// a text becomes an array of one string. What it throws (std::runtime_error) names the file and the place;
/// the file is there after close() or not at all.
class Hdf5Writer {
 public:
  explicit Hdf5Writer(const std::filesystem::path& file);
  ~Hdf5Writer();

  void write(const NamedArray& array);
  /// An array to be filled row by row (a row is all that one index of the first dimension has).
  void create(const std::string& name, const ArraySpec& spec);
  void write_row(const std::string& name, std::uint64_t row, std::span<const std::uint8_t> bytes);
  /// Strings of one fixed length (dtype S), as robomimic's masks are.
  void write_names(const std::string& name, const std::vector<std::string>& values);

  void set_attribute(const std::string& place, const std::string& name, const std::string& value);
  void set_attribute(const std::string& place, const std::string& name, std::int64_t value);
  void set_attribute(const std::string& place, const std::string& name, const std::vector<double>& values);
  void make_group(const std::string& name);
  /// `check` gets the finished file before it appears under its name, and throws if it is not whole.
  void close(const FileCheck& check = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Throws std::runtime_error that names the file and the place: not HDF5, cut short, a checksum that does not
/// match, an array of another type or shape.
class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::filesystem::path& file);
  ~Hdf5Reader();
  bool has(const std::string& name) const;  ///< every group on the way, too
  std::vector<std::string> children(const std::string& group) const;
  NamedArray read(const std::string& name, const ArraySpec& expected) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flowscope
