#include <algorithm>

#include "recorder/formats/hdf5_disk.h"
#include "recorder/formats/hdf5_file.h"
#include "recorder/formats/hdf5_handle.h"

namespace flowscope {
namespace {

constexpr int compression = 4;
constexpr std::uint64_t max_chunk_bytes = 1u << 20;

/// Checksummed, compressed, in pieces of whole rows: a reader of one frame unpacks little more than that
/// frame.
Hdf5Properties storage_of(const ArraySpec& spec) {
  Hdf5Properties properties(H5Pcreate(H5P_DATASET_CREATE));
  if (spec.shape.empty() || spec.bytes() == 0) return properties;
  std::vector<hsize_t> chunk(spec.shape.begin(), spec.shape.end());
  const std::uint64_t row_bytes = spec.bytes() / spec.shape.front();
  chunk.front() = std::clamp<std::uint64_t>(max_chunk_bytes / 4 / row_bytes, 1, spec.shape.front());
  H5Pset_chunk(properties.get(), static_cast<int>(chunk.size()), chunk.data());
  if (element_bytes(spec.type) > 1) H5Pset_shuffle(properties.get());
  H5Pset_deflate(properties.get(), compression);
  H5Pset_fletcher32(properties.get());
  return properties;
}

Hdf5Space space_of(const ArraySpec& spec) {
  if (spec.shape.empty()) return Hdf5Space(H5Screate(H5S_SCALAR));
  const std::vector<hsize_t> sizes(spec.shape.begin(), spec.shape.end());
  return Hdf5Space(H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr));
}

/// Groups on the way to a name come into being with it.
Hdf5Properties making_groups() {
  Hdf5Properties properties(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(properties.get(), 1);
  return properties;
}

}  // namespace

struct Hdf5Writer::Impl {
  explicit Impl(const std::filesystem::path& path) : target(path), disk(target.temporary()) {}

  NewFile target;
  Hdf5Disk disk;
  Hdf5FileHandle file{-1};  // closed before its file and disk go

  /// Sooner than the end of the file, where it would come out as well.
  void require_written(const std::string& place) const {
    if (disk.error() != 0) fail(place);
  }

  [[noreturn]] void fail(const std::string& place) const { target.fail(place + hdf5_cause()); }

  Hdf5Dataset create(const std::string& name, const ArraySpec& spec, std::size_t text_bytes) const {
    const Hdf5Type type = hdf5_type(spec.type, text_bytes);
    Hdf5Dataset dataset(H5Dcreate2(file.get(), name.c_str(), type.get(), space_of(spec).get(),
                                   making_groups().get(), storage_of(spec).get(), H5P_DEFAULT));
    if (!dataset.valid()) fail(name);
    return dataset;
  }

  void attribute(const std::string& place, const std::string& name, const Hdf5Type& type,
                 const Hdf5Space& space, const void* value) const {
    const Hdf5Object object(H5Oopen(file.get(), place.c_str(), H5P_DEFAULT));
    const Hdf5Attribute attribute(
        H5Acreate2(object.get(), name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT));
    if (!attribute.valid() || H5Awrite(attribute.get(), type.get(), value) < 0) fail(place + "@" + name);
  }
};

Hdf5Writer::Hdf5Writer(const std::filesystem::path& file) : impl_(std::make_unique<Impl>(file)) {
  // The form of version 1.10: it checksums its own tables too.
  const Hdf5Properties access(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  impl_->disk.use_in(access.get());
  impl_->file =
      Hdf5FileHandle(H5Fcreate(impl_->target.temporary().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()));
  if (!impl_->file.valid()) impl_->fail("cannot be created");
}

Hdf5Writer::~Hdf5Writer() = default;

void Hdf5Writer::write(const NamedArray& array) {
  ArraySpec spec = array.spec;
  if (spec.type == ArrayType::text) spec.shape = {1};  // what has no shape can carry no checksum
  const Hdf5Dataset dataset = impl_->create(array.name, spec, array.data.size());
  if (array.data.empty()) return;
  const Hdf5Type type = hdf5_type(array.spec.type, array.data.size());
  if (H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, array.data.data()) < 0) {
    impl_->fail(array.name);
  }
  impl_->require_written(array.name);
}

void Hdf5Writer::create(const std::string& name, const ArraySpec& spec) { impl_->create(name, spec, 0); }

void Hdf5Writer::write_row(const std::string& name, std::uint64_t row, std::span<const std::uint8_t> bytes) {
  const Hdf5Dataset dataset(H5Dopen2(impl_->file.get(), name.c_str(), H5P_DEFAULT));
  if (!dataset.valid()) impl_->fail(name);
  const Hdf5Space space(H5Dget_space(dataset.get()));
  const Hdf5Type type(H5Dget_type(dataset.get()));
  std::vector<hsize_t> count(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space.get())));
  H5Sget_simple_extent_dims(space.get(), count.data(), nullptr);
  count.front() = 1;
  std::vector<hsize_t> start(count.size(), 0);
  start.front() = row;
  const Hdf5Space memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr));
  const std::uint64_t expected =
      std::accumulate(count.begin(), count.end(), H5Tget_size(type.get()), std::multiplies<>());
  if (bytes.size() != expected) throw std::logic_error(name + ": the row has another size");
  if (H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dwrite(dataset.get(), type.get(), memory.get(), space.get(), H5P_DEFAULT, bytes.data()) < 0) {
    impl_->fail(name + "[" + std::to_string(row) + "]");
  }
  impl_->require_written(name);
}

void Hdf5Writer::write_names(const std::string& name, const std::vector<std::string>& values) {
  std::size_t length = 1;
  for (const std::string& value : values) length = std::max(length, value.size());
  std::string packed;
  for (const std::string& value : values) packed += value + std::string(length - value.size(), '\0');
  const hsize_t count = values.size();
  Hdf5Type type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), length);
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  const Hdf5Space space(H5Screate_simple(1, &count, nullptr));
  const Hdf5Dataset dataset(H5Dcreate2(impl_->file.get(), name.c_str(), type.get(), space.get(),
                                       making_groups().get(), H5P_DEFAULT, H5P_DEFAULT));
  if (!dataset.valid()) impl_->fail(name);
  if (count > 0 && H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, packed.data()) < 0) {
    impl_->fail(name);
  }
}

void Hdf5Writer::set_attribute(const std::string& place, const std::string& name, const std::string& value) {
  // Of variable length, outside the object's head, which holds 64 kB: a model's XML is longer.
  const Hdf5Type type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  const char* text = value.c_str();
  impl_->attribute(place, name, type, Hdf5Space(H5Screate(H5S_SCALAR)), &text);
}

void Hdf5Writer::set_attribute(const std::string& place, const std::string& name, std::int64_t value) {
  impl_->attribute(place, name, hdf5_type(ArrayType::i64, 0), Hdf5Space(H5Screate(H5S_SCALAR)), &value);
}

void Hdf5Writer::set_attribute(const std::string& place, const std::string& name,
                               const std::vector<double>& values) {
  const hsize_t count = values.size();
  impl_->attribute(place, name, hdf5_type(ArrayType::f64, 0), Hdf5Space(H5Screate_simple(1, &count, nullptr)),
                   values.data());
}

void Hdf5Writer::make_group(const std::string& name) {
  const Hdf5Object group(
      H5Gcreate2(impl_->file.get(), name.c_str(), making_groups().get(), H5P_DEFAULT, H5P_DEFAULT));
  if (!group.valid()) impl_->fail(name);
}

void Hdf5Writer::close(const FileCheck& check) {
  if (H5Fflush(impl_->file.get(), H5F_SCOPE_GLOBAL) < 0 || !impl_->file.close())
    impl_->fail("the end of the file");
  impl_->require_written("the end of the file");
  if (check) impl_->target.check(check);
  impl_->target.commit();
}

}  // namespace flowscope
