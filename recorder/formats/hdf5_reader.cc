#include <algorithm>

#include "recorder/formats/hdf5_file.h"
#include "recorder/formats/hdf5_handle.h"

namespace flowscope {
namespace {

const std::vector<std::uint64_t> text_shape{1};
constexpr std::size_t max_text_bytes = 16u << 20;

std::vector<std::uint64_t> shape_of(const Hdf5Space& space) {
  const int rank = H5Sget_simple_extent_ndims(space.get());
  std::vector<hsize_t> sizes(static_cast<std::size_t>(std::max(rank, 0)));
  H5Sget_simple_extent_dims(space.get(), sizes.data(), nullptr);
  return {sizes.begin(), sizes.end()};
}

}  // namespace

struct Hdf5Reader::Impl {
  std::filesystem::path path;
  Hdf5FileHandle file{-1};

  [[noreturn]] void fail(const std::string& problem) const { fail_hdf5(path, problem); }
  bool has(const std::string& name) const {
    for (std::size_t end = name.find('/', 1); end != std::string::npos; end = name.find('/', end + 1)) {
      if (H5Lexists(file.get(), name.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
    }
    return H5Lexists(file.get(), name.c_str(), H5P_DEFAULT) > 0;
  }
};

Hdf5Reader::Hdf5Reader(const std::filesystem::path& file) : impl_(std::make_unique<Impl>()) {
  prepare_hdf5();
  impl_->path = file;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw std::runtime_error(file.string() + ": there is no such file");
  }
  impl_->file = Hdf5FileHandle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  if (!impl_->file.valid()) impl_->fail("is not an HDF5 file, or is cut short");
}

Hdf5Reader::~Hdf5Reader() = default;

bool Hdf5Reader::has(const std::string& name) const { return impl_->has(name); }

std::vector<std::string> Hdf5Reader::children(const std::string& group) const {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5L_info_t*, void* list) -> herr_t {
    static_cast<std::vector<std::string>*>(list)->emplace_back(name);
    return 0;
  };
  hsize_t index = 0;
  if (H5Literate_by_name(impl_->file.get(), group.c_str(), H5_INDEX_NAME, H5_ITER_INC, &index, add, &names,
                         H5P_DEFAULT) < 0) {
    impl_->fail(group + " cannot be listed");
  }
  return names;
}

NamedArray Hdf5Reader::read(const std::string& name, const ArraySpec& expected) const {
  if (!impl_->has(name)) throw std::runtime_error(impl_->path.string() + ": has no " + name);
  const Hdf5Dataset dataset(H5Dopen2(impl_->file.get(), name.c_str(), H5P_DEFAULT));
  if (!dataset.valid()) impl_->fail(name + " is no array");
  const Hdf5Type stored(H5Dget_type(dataset.get()));
  const std::size_t text_bytes = H5Tget_size(stored.get());
  NamedArray array{name, expected, {}};
  const bool text = expected.type == ArrayType::text;
  if (text && (H5Tget_class(stored.get()) != H5T_STRING || H5Tis_variable_str(stored.get()) > 0 ||
               text_bytes > max_text_bytes)) {
    impl_->fail(name + " is no text");
  }
  const Hdf5Type type = hdf5_type(expected.type, text_bytes);
  if ((!text && H5Tequal(stored.get(), type.get()) <= 0) ||
      shape_of(Hdf5Space(H5Dget_space(dataset.get()))) != (text ? text_shape : expected.shape)) {
    impl_->fail(name + " has another type or shape");
  }
  array.data.resize(text ? text_bytes : expected.bytes());
  if (array.data.empty()) return array;
  if (H5Dread(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, array.data.data()) < 0) {
    impl_->fail(name + " cannot be read: damaged");
  }
  return array;
}

}  // namespace flowscope
