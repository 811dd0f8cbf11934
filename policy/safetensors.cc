#include "policy/safetensors.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <stdexcept>
#include <vector>

#include "policy/policy.h"
#include "policy/torch_parts.h"
#include "recorder/atomic_file.h"
#include "recorder/bytes.h"

namespace flowscope {
namespace {

using nlohmann::json;

constexpr const char* metadata_key = "__metadata__";
constexpr std::uint64_t length_bytes = 8, largest_header = 16 << 20;

struct Dtype {
  const char* name;
  torch::ScalarType type;
  std::uint64_t bytes;
  bool written;
};
constexpr Dtype dtypes[] = {{"I64", torch::kInt64, 8, true},    {"F32", torch::kFloat32, 4, true},
                            {"U8", torch::kUInt8, 1, true},     {"F64", torch::kFloat64, 8, false},
                            {"F16", torch::kFloat16, 2, false}, {"BF16", torch::kBFloat16, 2, false},
                            {"I32", torch::kInt32, 4, false},   {"BOOL", torch::kBool, 1, false}};

// ---- writing

const Dtype& dtype_to_write(const std::string& name, const torch::Tensor& tensor) {
  if (tensor.defined() && tensor.device().is_cpu() && tensor.layout() == torch::kStrided)
    for (const Dtype& dtype : dtypes)
      if (dtype.written && dtype.type == tensor.scalar_type()) return dtype;
  throw std::invalid_argument("safetensors: tensor \"" + name +
                              "\" is not a dense float32, int64 or uint8 tensor on the CPU");
}

std::string text_of(json header) {
  std::string text;
  try {
    text = header.dump();
  } catch (const json::type_error& error) {
    throw std::invalid_argument(std::string("safetensors: a text or name is not UTF-8: ") + error.what());
  }
  text.resize((text.size() + 7) / 8 * 8, ' ');  // the format's padding, so that the data begins aligned
  if (text.size() > largest_header)
    throw std::invalid_argument("safetensors: the texts and names exceed 16 MiB");
  return text;
}

// ---- reading

struct Complaint {
  std::string place, text;
};

struct Entry {
  std::string name;
  const Dtype* dtype = nullptr;
  std::vector<std::int64_t> shape;
  std::uint64_t begin = 0, end = 0;
};

/// Refuses deep nesting, and names that appear twice in one object: the parser would keep the last.
class HeaderGuard {
 public:
  bool operator()(int depth, json::parse_event_t event, json& parsed) {
    constexpr int deepest = 3;  // {"w":{"shape":[1]}}
    if (depth > deepest) throw Complaint{"header", "nested too deeply"};
    if (event == json::parse_event_t::object_start) keys_.emplace_back();
    if (event == json::parse_event_t::object_end) keys_.pop_back();
    if (event == json::parse_event_t::key && !keys_.back().insert(parsed.get<std::string>()).second)
      throw Complaint{"header", "\"" + parsed.get<std::string>() + "\" appears twice"};
    return true;
  }

 private:
  std::vector<std::set<std::string>> keys_;
};

/// Bytes that a shape stands for; nothing when it is none, or when its product overflows.
std::optional<std::uint64_t> bytes_of(const json& shape, std::uint64_t item_bytes,
                                      std::vector<std::int64_t>& sizes) {
  if (!shape.is_array() || shape.size() > 8) return std::nullopt;
  std::uint64_t strides = item_bytes;  // what torch computes: an empty dimension does not hide an overflow
  bool empty = false;
  for (const json& size : shape) {
    constexpr std::uint64_t longest = std::uint64_t{1} << 40;
    if (!size.is_number_unsigned() || size.get<std::uint64_t>() > longest) return std::nullopt;
    const auto count = size.get<std::uint64_t>();
    if (__builtin_mul_overflow(strides, std::max<std::uint64_t>(count, 1), &strides)) return std::nullopt;
    if (strides > (std::uint64_t{1} << 62)) return std::nullopt;
    empty |= count == 0;
    sizes.push_back(static_cast<std::int64_t>(count));
  }
  return empty ? 0 : strides;
}

Entry entry_of(const std::string& name, const json& value, std::uint64_t data_bytes) {
  const std::string place = "tensor \"" + name + "\"";
  if (!value.is_object() || value.size() != 3 || !value.contains("dtype") || !value.contains("shape") ||
      !value.contains("data_offsets"))
    throw Complaint{place, "is not {dtype, shape, data_offsets}"};
  Entry entry;
  entry.name = name;
  for (const Dtype& dtype : dtypes)
    if (value["dtype"] == dtype.name) entry.dtype = &dtype;
  if (!entry.dtype) throw Complaint{place, "unknown dtype " + value["dtype"].dump()};
  const auto bytes = bytes_of(value["shape"], entry.dtype->bytes, entry.shape);
  if (!bytes) throw Complaint{place, "absurd shape"};
  const json& offsets = value["data_offsets"];
  if (!offsets.is_array() || offsets.size() != 2 || !offsets[0].is_number_unsigned() ||
      !offsets[1].is_number_unsigned())
    throw Complaint{place, "data_offsets are not [begin, end]"};
  entry.begin = offsets[0].get<std::uint64_t>();
  entry.end = offsets[1].get<std::uint64_t>();
  if (entry.end < entry.begin) throw Complaint{place, "ends before it begins"};
  if (entry.end > data_bytes)
    throw Complaint{place, "ends " + std::to_string(entry.end - data_bytes) + " bytes behind the data"};
  if (entry.end - entry.begin != *bytes)
    throw Complaint{place, "has " + std::to_string(entry.end - entry.begin) +
                               " bytes where its shape needs " + std::to_string(*bytes)};
  return entry;
}

/// In the order of the data, which they fill without overlap and without a hole.
std::vector<Entry> entries_of(const json& header, std::uint64_t data_bytes) {
  std::vector<Entry> entries;
  for (const auto& [name, value] : header.items())
    if (name != metadata_key) entries.push_back(entry_of(name, value, data_bytes));
  std::ranges::sort(entries, {}, [](const Entry& e) { return std::pair(e.begin, e.end); });
  std::uint64_t next = 0;
  for (const Entry& entry : entries) {
    if (entry.begin < next) throw Complaint{"tensor \"" + entry.name + "\"", "overlaps the one before it"};
    if (entry.begin > next)
      throw Complaint{"tensor \"" + entry.name + "\"",
                      "begins " + std::to_string(entry.begin - next) + " bytes behind the one before it"};
    next = entry.end;
  }
  if (next != data_bytes)
    throw Complaint{"data", std::to_string(data_bytes - next) + " bytes belong to no tensor"};
  return entries;
}

/// One file being read, front to back.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : file_(path, std::ios::binary) {
    std::error_code error;
    left_ = std::filesystem::file_size(path, error);
    if (error || !file_) throw Complaint{"file", "cannot be opened"};
  }

  json header() {
    if (left_ < length_bytes) throw Complaint{"byte 0", "only " + std::to_string(left_) + " bytes"};
    std::uint64_t length = 0;
    read(&length, length_bytes);
    if (length > largest_header)
      throw Complaint{"byte 0", "header length above 16 MiB: not a safetensors file"};
    if (length > left_)
      throw Complaint{"byte 0",
                      "header of " + std::to_string(length) + " bytes does not fit: the file is cut"};
    std::string text(length, '\0');
    read(text.data(), length);
    if (text.empty() || text.front() != '{') throw Complaint{"header", "is not a JSON object"};
    HeaderGuard guard;
    return json::parse(text, [&guard](int depth, json::parse_event_t event, json& parsed) {
      return guard(depth, event, parsed);
    });
  }

  torch::Tensor tensor(const Entry& entry) {
    torch::Tensor tensor = torch::empty(entry.shape, entry.dtype->type);
    read(tensor.data_ptr(), entry.end - entry.begin);
    if (tensor.scalar_type() == torch::kBool) {
      const auto* first = static_cast<const std::uint8_t*>(tensor.data_ptr());
      if (std::any_of(first, first + tensor.numel(), [](std::uint8_t b) { return b > 1; }))
        throw Complaint{"tensor \"" + entry.name + "\"", "holds a truth value that is neither 0 nor 1"};
    }
    return tensor.is_floating_point() ? tensor.to(torch::kFloat32) : tensor;
  }

  std::uint64_t left() const { return left_; }

 private:
  void read(void* into, std::uint64_t count) {
    file_.read(static_cast<char*>(into), static_cast<std::streamsize>(count));
    if (file_.gcount() != static_cast<std::streamsize>(count))
      throw Complaint{"file", "cannot be read to its end"};
    left_ -= count;
  }

  std::ifstream file_;
  std::uint64_t left_ = 0;
};

TextByName metadata_of(const json& header) {
  TextByName texts;
  if (!header.contains(metadata_key)) return texts;
  const json& stored = header[metadata_key];
  if (!stored.is_object()) throw Complaint{metadata_key, "is not an object"};
  for (const auto& [name, value] : stored.items()) {
    if (!value.is_string())
      throw Complaint{std::string(metadata_key) + " \"" + name + "\"", "is not a string"};
    texts[name] = value.get<std::string>();
  }
  return texts;
}

}  // namespace

TensorsByName read_safetensors(const std::filesystem::path& path, TextByName* metadata) {
  try {
    Reader reader(path);
    const json header = reader.header();
    const TextByName texts = metadata_of(header);
    TensorsByName tensors;
    for (const Entry& entry : entries_of(header, reader.left())) tensors[entry.name] = reader.tensor(entry);
    if (metadata) *metadata = texts;
    return tensors;
  } catch (const json::exception& error) {
    throw BadCheckpoint(path.string() + ": header: " + error.what());
  } catch (const Complaint& complaint) {
    throw BadCheckpoint(path.string() + ": " + complaint.place + ": " + complaint.text);
  }
}

void write_safetensors(const std::filesystem::path& path, const TensorsByName& tensors,
                       const TextByName& metadata) {
  json header = json::object();
  if (!metadata.empty()) header[metadata_key] = metadata;
  std::vector<torch::Tensor> ordered;
  std::uint64_t offset = 0;
  for (const Dtype& dtype : dtypes) {  // the widest first, so that every tensor lies aligned
    for (const auto& [name, tensor] : tensors) {
      if (&dtype_to_write(name, tensor) != &dtype) continue;
      if (name == metadata_key) throw std::invalid_argument("safetensors: no tensor may be named " + name);
      const std::uint64_t end = offset + tensor.nbytes();
      header[name] = {
          {"dtype", dtype.name}, {"shape", tensor.sizes().vec()}, {"data_offsets", {offset, end}}};
      ordered.push_back(tensor);
      offset = end;
    }
  }
  const std::string text = text_of(std::move(header));
  Bytes bytes;
  bytes.reserve(length_bytes + text.size() + offset);
  put(bytes, static_cast<std::uint64_t>(text.size()));
  bytes.insert(bytes.end(), text.begin(), text.end());
  for (const torch::Tensor& tensor : ordered) {
    const torch::Tensor dense = tensor.detach().contiguous();
    const auto* first = static_cast<const std::uint8_t*>(dense.data_ptr());
    bytes.insert(bytes.end(), first, first + dense.nbytes());
  }
  write_file_atomically(path, bytes);
}

}  // namespace flowscope
