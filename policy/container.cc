#include "policy/container.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>

#include "policy/policy.h"
#include "recorder/atomic_file.h"
#include "recorder/sha256.h"

namespace flowscope {
namespace {

static_assert(std::endian::native == std::endian::little, "the data is stored as it lies in memory");

constexpr const char* kFormat = "flowscope-policy/1";
constexpr std::uint64_t kLengthBytes = 8, kLargestHeader = 1 << 20, kTrailerBytes = 64;

using Bytes = std::vector<std::uint8_t>;
using nlohmann::json;

struct Dtype {
  const char* name;
  torch::ScalarType type;
  std::uint64_t bytes;
};
constexpr Dtype kDtypes[] = {
    {"f32", torch::kFloat32, 4}, {"i64", torch::kInt64, 8}, {"u8", torch::kUInt8, 1}};

const Dtype* find_dtype(torch::ScalarType type) {
  for (const Dtype& dtype : kDtypes) {
    if (dtype.type == type) return &dtype;
  }
  return nullptr;
}

const Dtype* find_dtype(const std::string& name) {
  for (const Dtype& dtype : kDtypes) {
    if (dtype.name == name) return &dtype;
  }
  return nullptr;
}

// ---- writing

json describe(const NamedTensor& named, std::uint64_t offset) {
  const Dtype* dtype = named.tensor.defined() ? find_dtype(named.tensor.scalar_type()) : nullptr;
  if (!dtype || !named.tensor.device().is_cpu() || named.tensor.layout() != torch::kStrided) {
    throw std::invalid_argument("container: tensor \"" + named.name +
                                "\" is not a dense float32, int64 or uint8 tensor on the CPU");
  }
  return {{"name", named.name},
          {"dtype", dtype->name},
          {"shape", named.tensor.sizes().vec()},
          {"offset", offset}};
}

std::string header_of(const Container& container) {
  json tensors = json::array();
  std::set<std::string> names;
  std::uint64_t offset = 0;
  for (const NamedTensor& named : container.tensors) {
    if (!names.insert(named.name).second) {
      throw std::invalid_argument("container: two tensors are named \"" + named.name + "\"");
    }
    tensors.push_back(describe(named, offset));
    offset += named.tensor.nbytes();
  }
  std::string header;
  try {
    header = json{{"format", kFormat}, {"text", container.text}, {"tensors", std::move(tensors)}}.dump();
  } catch (const json::type_error& error) {
    throw std::invalid_argument(std::string("container: a text or name is not UTF-8: ") + error.what());
  }
  if (header.size() > kLargestHeader)
    throw std::invalid_argument("container: the texts and names exceed 1 MiB");
  return header;
}

void append(Bytes& bytes, const void* from, std::uint64_t count) {
  const auto* first = static_cast<const std::uint8_t*>(from);
  bytes.insert(bytes.end(), first, first + count);
}

// ---- reading

/// One file being read; every complaint names it.
class Reader {
 public:
  explicit Reader(std::filesystem::path path) : path_(std::move(path)), bytes_(load()) {}

  Container read() const {
    const std::uint64_t header_length = read_header_length();
    const std::span<const std::uint8_t> header(bytes_.data() + kLengthBytes, header_length);
    const std::uint64_t data_length = bytes_.size() - kLengthBytes - header_length - kTrailerBytes;
    const std::string damage =
        checksum_differs() ? "; the checksum differs too: the file is cut or damaged" : "";
    try {
      const json parsed = parse(header);
      Container container;
      container.text = read_text(parsed);
      read_tensors(parsed, bytes_.data() + kLengthBytes + header_length, data_length, container);
      if (!damage.empty()) fail("checksum", "differs from the stored one: the file is damaged");
      return container;
    } catch (const json::exception& error) {
      fail("header", error.what() + damage);
    } catch (const Complaint& complaint) {
      fail(complaint.place, complaint.text + damage);
    }
  }

 private:
  struct Complaint {
    std::string place, text;
  };

  [[noreturn]] void fail(const std::string& place, const std::string& text) const {
    throw BadCheckpoint(path_.string() + ": " + place + ": " + text);
  }

  Bytes load() const {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path_, error);
    std::ifstream file(path_, std::ios::binary);
    if (error || !file) fail("file", "cannot be opened" + (error ? ": " + error.message() : std::string()));
    Bytes bytes(size);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    if (file.gcount() != static_cast<std::streamsize>(size)) fail("file", "cannot be read to its end");
    return bytes;
  }

  std::uint64_t read_header_length() const {
    if (bytes_.size() < kLengthBytes + kTrailerBytes) {
      fail("byte 0", "only " + std::to_string(bytes_.size()) + " bytes: cut, or not a flowscope policy");
    }
    std::uint64_t length = 0;
    std::memcpy(&length, bytes_.data(), kLengthBytes);
    if (length > kLargestHeader) fail("byte 0", "header length above 1 MiB: not a flowscope policy");
    if (length > bytes_.size() - kLengthBytes - kTrailerBytes) {
      fail("byte 0",
           "header of " + std::to_string(length) + " bytes does not fit: cut, or not a flowscope policy");
    }
    return length;
  }

  bool checksum_differs() const {
    const std::span<const std::uint8_t> all(bytes_);
    const auto trailer = all.last(kTrailerBytes);
    return sha256_hex(all.first(all.size() - kTrailerBytes)) != std::string(trailer.begin(), trailer.end());
  }

  static json parse(std::span<const std::uint8_t> header) {
    constexpr int kDeepest = 4;  // {"tensors":[{"shape":[1]}]}
    const auto shallow = [](int depth, json::parse_event_t, json&) {
      if (depth > kDeepest) throw Complaint{"header", "nested too deeply"};
      return true;
    };
    json parsed = json::parse(header.begin(), header.end(), shallow);
    if (!parsed.is_object() || parsed.value("format", json()) != kFormat) {
      throw Complaint{"header", std::string("its format is not \"") + kFormat + "\""};
    }
    return parsed;
  }

  static std::map<std::string, std::string> read_text(const json& header) {
    std::map<std::string, std::string> text;
    for (const auto& [name, value] : header.at("text").items()) {
      if (!value.is_string()) throw Complaint{"header text \"" + name + "\"", "not a string"};
      text[name] = value.get<std::string>();
    }
    return text;
  }

  /// Bytes that the entry claims, if its shape is sane.
  static std::optional<std::uint64_t> claimed_bytes(const json& shape, std::uint64_t item_bytes,
                                                    std::vector<std::int64_t>& sizes) {
    if (!shape.is_array() || shape.size() > 8) return std::nullopt;
    std::uint64_t total = item_bytes;
    for (const json& size : shape) {
      constexpr std::uint64_t kLongest = std::uint64_t{1} << 40;
      if (!size.is_number_unsigned() || size.get<std::uint64_t>() > kLongest) return std::nullopt;
      if (__builtin_mul_overflow(total, size.get<std::uint64_t>(), &total)) return std::nullopt;
      sizes.push_back(size.get<std::int64_t>());
    }
    return total;
  }

  static void read_tensors(const json& header, const std::uint8_t* data, std::uint64_t data_length,
                           Container& container) {
    std::uint64_t next = 0;
    std::set<std::string> names;
    const json& entries = header.at("tensors");
    if (!entries.is_array()) throw Complaint{"header tensors", "not a list"};
    for (const json& entry : entries) {
      const auto name = entry.at("name").get<std::string>();
      const std::string place = "tensor \"" + name + "\"";
      if (!names.insert(name).second) throw Complaint{place, "appears twice"};
      const Dtype* dtype = find_dtype(entry.at("dtype").get<std::string>());
      if (!dtype) throw Complaint{place, "unknown dtype"};
      std::vector<std::int64_t> sizes;
      const auto bytes = claimed_bytes(entry.at("shape"), dtype->bytes, sizes);
      if (!bytes) throw Complaint{place, "absurd shape"};
      const json& offset = entry.at("offset");
      if (!offset.is_number_unsigned() || offset.get<std::uint64_t>() != next) {
        throw Complaint{place, "its data should begin at offset " + std::to_string(next)};
      }
      if (*bytes > data_length - next) {
        throw Complaint{place,
                        "ends " + std::to_string(*bytes - (data_length - next)) + " bytes behind the data"};
      }
      torch::Tensor tensor = torch::empty(sizes, dtype->type);
      if (*bytes > 0) std::memcpy(tensor.data_ptr(), data + next, *bytes);
      container.tensors.push_back({name, tensor});
      next += *bytes;
    }
    if (next != data_length) {
      throw Complaint{"data", std::to_string(data_length - next) + " bytes belong to no tensor"};
    }
  }

  const std::filesystem::path path_;
  const Bytes bytes_;
};

}  // namespace

void write_container(const std::filesystem::path& path, const Container& container) {
  const std::string header = header_of(container);
  const std::uint64_t header_length = header.size();
  Bytes bytes;
  append(bytes, &header_length, kLengthBytes);
  append(bytes, header.data(), header.size());
  for (const NamedTensor& named : container.tensors) {
    const torch::Tensor dense = named.tensor.detach().contiguous();
    append(bytes, dense.data_ptr(), dense.nbytes());
  }
  const std::string checksum = sha256_hex(bytes);
  append(bytes, checksum.data(), checksum.size());
  write_file_atomically(path, bytes);
}

Container read_container(const std::filesystem::path& path) { return Reader(path).read(); }

}  // namespace flowscope
