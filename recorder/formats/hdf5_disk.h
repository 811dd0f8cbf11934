// Inside of hdf5_*.cc only: the disk below an HDF5 file that is written.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>

namespace flowscope {

/// HDF5 keeps a file for ever that it could not write to its end. So this driver takes every write and keeps
/// the first failure to itself: the library closes the file as if nothing had happened, and whoever writes
/// asks error(). Outlives the file. One thread.
class Hdf5Disk {
 public:
  /// Of a file that exists; the first call of all to the library. Throws std::runtime_error when the library
  /// refuses the driver.
  explicit Hdf5Disk(const std::filesystem::path& file);
  ~Hdf5Disk();
  Hdf5Disk(const Hdf5Disk&) = delete;
  Hdf5Disk& operator=(const Hdf5Disk&) = delete;

  /// Files created with these properties lie on this disk.
  void use_in(hid_t access);
  /// errno of the first write that failed; 0 while all is well.
  int error() const { return error_; }

  bool read(std::uint64_t at, std::size_t size, void* buffer);
  void write(std::uint64_t at, std::size_t size, const void* buffer);
  void truncate(std::uint64_t size);

 private:
  hid_t driver_ = -1;
  int file_ = -1, error_ = 0;
};

}  // namespace flowscope
