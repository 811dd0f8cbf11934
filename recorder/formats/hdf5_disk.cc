#include "recorder/formats/hdf5_disk.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "recorder/formats/hdf5_handle.h"

namespace flowscope {
namespace {

/// What the library copies about: which disk.
struct Place {
  Hdf5Disk* disk;
};

/// One open file; the library owns the first member.
struct OpenFile {
  H5FD_t head{};
  Hdf5Disk* disk = nullptr;
  haddr_t allocated = 0, end = 0;
};

OpenFile& open_file(H5FD_t* file) { return *reinterpret_cast<OpenFile*>(file); }
const OpenFile& open_file(const H5FD_t* file) { return *reinterpret_cast<const OpenFile*>(file); }

H5FD_t* open(const char*, unsigned, hid_t access, haddr_t) {
  const auto* place = static_cast<const Place*>(H5Pget_driver_info(access));
  if (place == nullptr) return nullptr;
  auto* file = new OpenFile;
  file->disk = place->disk;
  return &file->head;
}

herr_t close(H5FD_t* file) {
  delete &open_file(file);
  return 0;
}

/// As the library's own driver: metadata and small arrays lie together.
herr_t query(const H5FD_t*, unsigned long* flags) {
  if (flags != nullptr) {
    *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
             H5FD_FEAT_AGGREGATE_SMALLDATA;
  }
  return 0;
}

haddr_t allocated(const H5FD_t* file, H5FD_mem_t) { return open_file(file).allocated; }

herr_t allocate(H5FD_t* file, H5FD_mem_t, haddr_t size) {
  open_file(file).allocated = size;
  return 0;
}

haddr_t end(const H5FD_t* file, H5FD_mem_t) { return open_file(file).end; }

herr_t read(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, std::size_t size, void* buffer) {
  return open_file(file).disk->read(at, size, buffer) ? 0 : -1;
}

herr_t write(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, std::size_t size, const void* buffer) {
  OpenFile& open = open_file(file);
  open.disk->write(at, size, buffer);
  open.end = std::max<haddr_t>(open.end, at + size);
  return 0;
}

herr_t truncate(H5FD_t* file, hid_t, hbool_t) {
  OpenFile& open = open_file(file);
  if (open.end != open.allocated) open.disk->truncate(open.allocated);
  open.end = open.allocated;
  return 0;
}

herr_t lock(H5FD_t*, hbool_t) { return 0; }
herr_t unlock(H5FD_t*) { return 0; }

hid_t register_driver() {
  prepare_hdf5();
  constexpr H5FD_mem_t map[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
  H5FD_class_t driver{};
  driver.name = "flowscope";
  driver.maxaddr = static_cast<haddr_t>(std::numeric_limits<off_t>::max());
  driver.fc_degree = H5F_CLOSE_WEAK;
  driver.fapl_size = sizeof(Place);
  driver.open = open;
  driver.close = close;
  driver.query = query;
  driver.get_eoa = allocated;
  driver.set_eoa = allocate;
  driver.get_eof = end;
  driver.read = read;
  driver.write = write;
  driver.truncate = truncate;
  driver.lock = lock;
  driver.unlock = unlock;
  std::ranges::copy(map, driver.fl_map);
  return H5FDregister(&driver);
}

}  // namespace

Hdf5Disk::Hdf5Disk(const std::filesystem::path& file)
    : driver_(register_driver()), file_(::open(file.c_str(), O_RDWR | O_CLOEXEC)) {
  if (file_ < 0) error_ = errno;
  if (driver_ < 0) throw std::runtime_error("HDF5 takes no driver of files");
}

Hdf5Disk::~Hdf5Disk() {
  if (file_ >= 0) ::close(file_);
  H5FDunregister(driver_);
}

void Hdf5Disk::use_in(hid_t access) {
  const Place place{this};
  if (H5Pset_driver(access, driver_, &place) < 0) throw std::runtime_error("HDF5 takes no driver of files");
}

bool Hdf5Disk::read(std::uint64_t at, std::size_t size, void* buffer) {
  auto* next = static_cast<std::uint8_t*>(buffer);
  while (size > 0) {
    const ssize_t count = ::pread(file_, next, size, static_cast<off_t>(at));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && error_ == 0) return false;
    if (count <= 0) break;
    next += count;
    at += static_cast<std::uint64_t>(count);
    size -= static_cast<std::size_t>(count);
  }
  std::memset(next, 0, size);  // behind the end
  return true;
}

void Hdf5Disk::write(std::uint64_t at, std::size_t size, const void* buffer) {
  const auto* next = static_cast<const std::uint8_t*>(buffer);
  while (size > 0 && error_ == 0) {
    const ssize_t count = ::pwrite(file_, next, size, static_cast<off_t>(at));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      error_ = errno;
      return;
    }
    next += count;
    at += static_cast<std::uint64_t>(count);
    size -= static_cast<std::size_t>(count);
  }
}

void Hdf5Disk::truncate(std::uint64_t size) {
  if (error_ == 0 && ::ftruncate(file_, static_cast<off_t>(size)) != 0) error_ = errno;
}

}  // namespace flowscope
