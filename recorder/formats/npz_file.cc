#include "recorder/formats/npz_file.h"

#include <minizip/unzip.h>
#include <minizip/zip.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <unordered_map>

#include "recorder/formats/npy_header.h"

namespace flowscope {
namespace {

constexpr std::uint64_t max_text_bytes = 16u << 20;
constexpr int compression = 4;  // of level 9's gain all but a few percent, in a third of the time
constexpr std::size_t chunk_bytes = 1u << 30;  // the archive's functions count in 32 bits

}  // namespace

struct NpzWriter::Impl {
  explicit Impl(const std::filesystem::path& path) : target(path) {}

  NewFile target;
  zipFile archive = nullptr;

  void require(int result, const std::string& name) const {
    if (result != ZIP_OK) target.fail(name);
  }
  void write(const void* bytes, std::size_t count, const std::string& name) const {
    const auto* next = static_cast<const std::uint8_t*>(bytes);
    while (count > 0) {
      const std::size_t part = std::min(count, chunk_bytes);
      require(zipWriteInFileInZip(archive, next, static_cast<unsigned>(part)), name);
      next += part;
      count -= part;
    }
  }
};

NpzWriter::NpzWriter(const std::filesystem::path& file) : impl_(std::make_unique<Impl>(file)) {
  impl_->archive = zipOpen64(impl_->target.temporary().c_str(), APPEND_STATUS_CREATE);
  if (impl_->archive == nullptr) impl_->target.fail("cannot be created");
}

NpzWriter::~NpzWriter() {
  if (impl_->archive != nullptr) zipClose(impl_->archive, nullptr);
}

void NpzWriter::add(const NamedArray& array) {
  zip_fileinfo info{};  // the same content gives the same file: no time of writing
  info.tmz_date.tm_year = 1980;
  info.tmz_date.tm_mday = 1;
  const int large = array.data.size() > 0xf0000000u ? 1 : 0;
  impl_->require(zipOpenNewFileInZip64(impl_->archive, (array.name + ".npy").c_str(), &info, nullptr, 0,
                                       nullptr, 0, nullptr, Z_DEFLATED, compression, large),
                 array.name);
  const std::string header = npy_header(array.spec, array.data.size());
  impl_->write(header.data(), header.size(), array.name);
  impl_->write(array.data.data(), array.data.size(), array.name);
  impl_->require(zipCloseFileInZip(impl_->archive), array.name);
}

void NpzWriter::finish(const FileCheck& check) {
  const int result = zipClose(impl_->archive, nullptr);
  impl_->archive = nullptr;
  impl_->require(result, "the list of arrays");
  if (check) impl_->target.check(check);
  impl_->target.commit();
}

struct NpzReader::Impl {
  std::filesystem::path file;
  unzFile archive = nullptr;
  struct Entry {
    unz64_file_pos place;
    std::uint64_t bytes;
  };
  std::unordered_map<std::string, Entry> entries;

  [[noreturn]] void fail(const std::string& problem) const {
    throw std::runtime_error(file.string() + ": " + problem);
  }
  /// The names once: looking one up in the archive itself walks through all of them.
  void list() {
    for (int result = unzGoToFirstFile(archive); result != UNZ_END_OF_LIST_OF_FILE;
         result = unzGoToNextFile(archive)) {
      std::array<char, 512> name{};
      unz_file_info64 info{};
      Entry entry{};
      if (result != UNZ_OK ||
          unzGetCurrentFileInfo64(archive, &info, name.data(), name.size() - 1, nullptr, 0, nullptr, 0) !=
              UNZ_OK ||
          unzGetFilePos64(archive, &entry.place) != UNZ_OK) {
        fail("the archive's list of files is damaged");
      }
      entry.bytes = info.uncompressed_size;
      entries.emplace(name.data(), entry);
    }
  }
  Bytes content(const Entry& entry, const std::string& name) const {
    unz64_file_pos place = entry.place;
    if (unzGoToFilePos64(archive, &place) != UNZ_OK || unzOpenCurrentFile(archive) != UNZ_OK) {
      fail(name + " cannot be read");
    }
    Bytes bytes(entry.bytes);
    std::size_t done = 0;
    int count = 1;
    while (done < bytes.size() && count > 0) {
      count = unzReadCurrentFile(archive, bytes.data() + done,
                                 static_cast<unsigned>(std::min(bytes.size() - done, chunk_bytes)));
      if (count > 0) done += static_cast<std::size_t>(count);
    }
    const int closed = unzCloseCurrentFile(archive);
    if (done != bytes.size()) fail(name + " is cut short or damaged");
    if (closed != UNZ_OK) fail(name + ": checksum does not match");
    return bytes;
  }
};

NpzReader::NpzReader(const std::filesystem::path& file) : impl_(std::make_unique<Impl>()) {
  impl_->file = file;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) impl_->fail("there is no such file");
  impl_->archive = unzOpen64(file.c_str());
  if (impl_->archive == nullptr) impl_->fail("is not an NPZ file, or is cut short");
  try {
    impl_->list();
  } catch (...) {
    unzClose(impl_->archive);
    throw;
  }
}

NpzReader::~NpzReader() { unzClose(impl_->archive); }

bool NpzReader::has(const std::string& name) const { return impl_->entries.contains(name + ".npy"); }

NamedArray NpzReader::read(const std::string& name, const ArraySpec& expected) const {
  const auto found = impl_->entries.find(name + ".npy");
  if (found == impl_->entries.end()) impl_->fail("has no array " + name);
  const bool text = expected.type == ArrayType::text;
  std::uint64_t data_bytes = expected.bytes();
  if (text) {
    constexpr std::uint64_t head_bytes = 128;  // of any text: its length is a few digits of them
    if (found->second.bytes < head_bytes || found->second.bytes > max_text_bytes)
      impl_->fail(name + " is no text");
    data_bytes = found->second.bytes - head_bytes;
  }
  const std::string head = npy_header(expected, data_bytes);
  if (found->second.bytes != head.size() + data_bytes) impl_->fail(name + " has another type or shape");
  Bytes bytes = impl_->content(found->second, name);
  if (!std::equal(head.begin(), head.end(), bytes.begin(),
                  [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; })) {
    impl_->fail(name + " has another type or shape");
  }
  bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(head.size()));
  return {name, expected, std::move(bytes)};
}

}  // namespace flowscope
