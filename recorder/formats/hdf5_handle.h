// Inside of hdf5_*.cc only: HDF5's handles and its way of failing.
#pragma once

#include <hdf5.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>

#include "recorder/formats/named_array.h"

namespace flowscope {

/// Closes what it holds. `Close` is the library's function for that kind of handle.
template <herr_t (*Close)(hid_t)>
class Hdf5Handle {
 public:
  explicit Hdf5Handle(hid_t id) : id_(id) {}
  ~Hdf5Handle() {
    if (id_ >= 0) Close(id_);
  }
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  hid_t get() const { return id_; }
  bool valid() const { return id_ >= 0; }
  /// The library may find out only now that a disk is full: false then.
  bool close() { return Close(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_;
};

using Hdf5FileHandle = Hdf5Handle<H5Fclose>;
using Hdf5Dataset = Hdf5Handle<H5Dclose>;
using Hdf5Space = Hdf5Handle<H5Sclose>;
using Hdf5Type = Hdf5Handle<H5Tclose>;
using Hdf5Properties = Hdf5Handle<H5Pclose>;
using Hdf5Object = Hdf5Handle<H5Oclose>;
using Hdf5Attribute = Hdf5Handle<H5Aclose>;

/// The library prints every failure by itself until this was called once per thread. Where it holds a file
/// that could not be closed it would crash at the program's end: ours are closed long before that.
inline void prepare_hdf5() {
  H5dont_atexit();  // works before any other call only
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

/// What the library says about its last failure, the cause only.
inline std::string hdf5_cause() {
  std::string cause;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* text) -> herr_t {
        auto& out = *static_cast<std::string*>(text);
        if (out.empty() && error->desc != nullptr) out = error->desc;
        return 0;
      },
      &cause);
  return cause.empty() ? "" : " (" + cause + ")";
}

[[noreturn]] inline void fail_hdf5(const std::filesystem::path& file, const std::string& problem) {
  throw std::runtime_error(file.string() + ": " + problem + hdf5_cause());
}

/// Type of one element, in the file and in memory (both little-endian). For a text: of `length` bytes.
inline Hdf5Type hdf5_type(ArrayType type, std::size_t length) {
  switch (type) {
    case ArrayType::u8:
      return Hdf5Type(H5Tcopy(H5T_STD_U8LE));
    case ArrayType::i32:
      return Hdf5Type(H5Tcopy(H5T_STD_I32LE));
    case ArrayType::i64:
      return Hdf5Type(H5Tcopy(H5T_STD_I64LE));
    case ArrayType::f32:
      return Hdf5Type(H5Tcopy(H5T_IEEE_F32LE));
    case ArrayType::f64:
      return Hdf5Type(H5Tcopy(H5T_IEEE_F64LE));
    case ArrayType::text:
      break;
  }
  Hdf5Type text(H5Tcopy(H5T_C_S1));
  H5Tset_size(text.get(), length == 0 ? 1 : length);
  H5Tset_strpad(text.get(), H5T_STR_NULLPAD);
  H5Tset_cset(text.get(), H5T_CSET_UTF8);
  return text;
}

}  // namespace flowscope
