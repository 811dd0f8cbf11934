#include "recorder/mesh/gltf_file.h"

#include <algorithm>
#include <cstring>
#include <map>

#include "recorder/mesh/mesh_neighbour.h"

namespace flowscope {
namespace {

using nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uintmax_t kMost_mib = 256;
constexpr std::size_t kMost_elements = 8'000'000;
constexpr int kByte = 5120, kUnsigned_byte = 5121, kShort = 5122, kUnsigned_short = 5123,
              kUnsigned_int = 5125, kFloat = 5126;

std::uint32_t word_at(const Bytes& bytes, std::size_t at) {
  std::uint32_t word = 0;
  if (at + 4 > bytes.size()) throw BadGltf("ends too early");
  std::memcpy(&word, bytes.data() + at, 4);
  return word;
}

std::size_t bytes_of_component(int component) {
  switch (component) {
    case kByte:
    case kUnsigned_byte:
      return 1;
    case kShort:
    case kUnsigned_short:
      return 2;
    case kUnsigned_int:
    case kFloat:
      return 4;
    default:
      throw BadGltf("has numbers of the unknown type " + std::to_string(component));
  }
}

template <class T>
double number_as(const std::uint8_t* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double number_at(const std::uint8_t* at, int component, bool normalized) {
  switch (component) {
    case kByte:
      return normalized ? std::max(number_as<std::int8_t>(at) / 127, -1.0) : number_as<std::int8_t>(at);
    case kUnsigned_byte:
      return number_as<std::uint8_t>(at) / (normalized ? 255 : 1);
    case kShort:
      return normalized ? std::max(number_as<std::int16_t>(at) / 32767, -1.0) : number_as<std::int16_t>(at);
    case kUnsigned_short:
      return number_as<std::uint16_t>(at) / (normalized ? 65535 : 1);
    case kUnsigned_int:
      return number_as<std::uint32_t>(at);
    default:
      return number_as<float>(at);
  }
}

std::size_t width_of(const std::string& type) {
  static const std::map<std::string, std::size_t> known{{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
  const auto it = known.find(type);
  if (it == known.end()) throw BadGltf("has an accessor of the type " + type + " where none belongs");
  return it->second;
}

int value_of(char letter) {
  if (letter >= 'A' && letter <= 'Z') return letter - 'A';
  if (letter >= 'a' && letter <= 'z') return letter - 'a' + 26;
  if (letter >= '0' && letter <= '9') return letter - '0' + 52;
  if (letter == '+' || letter == '-') return 62;
  if (letter == '/' || letter == '_') return 63;
  return -1;
}

}  // namespace

Bytes bytes_of_data_uri(const std::string& uri) {
  const auto comma = uri.find(',');
  if (comma == std::string::npos || uri.substr(0, comma).find(";base64") == std::string::npos)
    throw BadGltf("has a data: URI that is not base64");
  Bytes bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (std::size_t i = comma + 1; i < uri.size() && uri[i] != '='; ++i) {
    const int value = value_of(uri[i]);
    if (value < 0) throw BadGltf("has a data: URI that is not base64");
    word = word << 6 | static_cast<std::uint32_t>(value);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<std::uint8_t>(word >> bits));
  }
  return bytes;
}

GltfFile::GltfFile(const std::filesystem::path& file)
    : folder_(file.has_parent_path() ? file.parent_path() : std::filesystem::path(".")) {
  Bytes bytes = bytes_of(file, kMost_mib), binary;
  if (bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0) {
    if (word_at(bytes, 4) != 2) return;  // of version 1: is_version_2() says so
    for (std::size_t at = 12; at + 8 <= bytes.size();) {
      const std::size_t length = word_at(bytes, at), begin = at + 8;
      const std::uint32_t kind = word_at(bytes, at + 4);
      if (length > bytes.size() - begin) throw BadGltf("ends too early");
      const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto last = first + static_cast<std::ptrdiff_t>(length);
      if (kind == 0x4E4F534A && root_.is_null()) root_ = json::parse(first, last);
      if (kind == 0x004E4942 && binary.empty()) binary.assign(first, last);
      at = begin + length;
    }
  } else {
    root_ = json::parse(bytes.begin(), bytes.end());
  }
  if (!root_.is_object()) throw BadGltf("holds no glTF");
  if (is_version_2()) open_buffers(std::move(binary));
}

bool GltfFile::is_version_2() const {
  if (!root_.is_object()) return false;
  const auto asset = root_.find("asset");
  return asset != root_.end() && asset->value("version", std::string("1")).starts_with("2");
}

void GltfFile::open_buffers(Bytes binary) {
  if (!root_.contains("buffers")) return;
  for (const json& buffer : root_["buffers"]) {
    const std::string uri = buffer.value("uri", std::string());
    if (uri.empty()) {
      buffers_.push_back(buffers_.empty() ? std::move(binary) : Bytes{});
    } else if (uri.starts_with("data:")) {
      buffers_.push_back(bytes_of_data_uri(uri));
    } else {
      try {
        buffers_.push_back(bytes_of(neighbour(folder_, uri), kMost_mib));
      } catch (const std::runtime_error& error) {
        throw BadGltf("its buffer '" + uri + "' " + error.what());
      }
    }
  }
}

const json& GltfFile::entry(const char* list, std::size_t index) const {
  const auto found = root_.find(list);
  if (found == root_.end() || !found->is_array() || index >= found->size())
    throw BadGltf("names an entry " + std::to_string(index) + " of its " + list + " that does not exist");
  return (*found)[index];
}

std::span<const std::uint8_t> GltfFile::view(std::size_t buffer_view) const {
  const json& view = entry("bufferViews", buffer_view);
  const auto buffer = view.at("buffer").get<std::size_t>();
  const auto offset = view.value("byteOffset", std::size_t{0}),
             length = view.at("byteLength").get<std::size_t>();
  if (buffer >= buffers_.size()) throw BadGltf("names a buffer that does not exist");
  const Bytes& bytes = buffers_[buffer];
  if (offset > bytes.size() || length > bytes.size() - offset) {
    if (view.contains("extensions"))
      throw BadGltf("holds data only as " + view["extensions"].begin().key() +
                    ", which is not read; write it without");
    throw BadGltf("has a view that reaches beyond its buffer");
  }
  return std::span(bytes).subspan(offset, length);
}

/// Where an accessor's elements lie.
struct GltfFile::Layout {
  std::span<const std::uint8_t> bytes;
  std::size_t stride = 0;
  const std::uint8_t* at(std::size_t element) const { return bytes.data() + element * stride; }
};

GltfFile::Layout GltfFile::layout_of(const json& holder, int component, std::size_t width,
                                     std::size_t count) const {
  const auto index = holder.at("bufferView").get<std::size_t>();
  const auto offset = holder.value("byteOffset", std::size_t{0});
  Layout layout{view(index)};
  const std::size_t packed = bytes_of_component(component) * width;
  layout.stride = entry("bufferViews", index).value("byteStride", std::size_t{0});
  if (layout.stride == 0) layout.stride = packed;
  const std::size_t needed = count == 0 ? 0 : (count - 1) * layout.stride + packed;
  if (layout.stride > 4096 || offset > layout.bytes.size() || needed > layout.bytes.size() - offset)
    throw BadGltf("has an accessor that reaches beyond its view");
  layout.bytes = layout.bytes.subspan(offset);
  return layout;
}

std::vector<std::array<float, 4>> GltfFile::vectors(std::size_t accessor, std::size_t& width) const {
  const json& about = entry("accessors", accessor);
  width = width_of(about.at("type").get<std::string>());
  const int component = about.at("componentType").get<int>();
  const bool normalized = about.value("normalized", false);
  const auto count = about.at("count").get<std::size_t>();
  if (count > kMost_elements) throw BadGltf("has an accessor of more than 8000000 elements");
  std::vector<std::array<float, 4>> result(count, {0, 0, 0, 1});
  const auto read = [&](const Layout& layout, std::size_t from, std::size_t to) {
    for (std::size_t k = 0; k < width; ++k)
      result[to][k] = static_cast<float>(
          number_at(layout.at(from) + k * bytes_of_component(component), component, normalized));
  };
  if (about.contains("bufferView")) {
    const Layout layout = layout_of(about, component, width, count);
    for (std::size_t i = 0; i < count; ++i) read(layout, i, i);
  }
  if (about.contains("sparse")) {
    const json& sparse = about["sparse"];
    const auto changed = sparse.at("count").get<std::size_t>();
    if (changed > count) throw BadGltf("changes more elements of an accessor than it has");
    const int type = sparse.at("indices").at("componentType").get<int>();
    const Layout places = layout_of(sparse.at("indices"), type, 1, changed);
    const Layout values = layout_of(sparse.at("values"), component, width, changed);
    for (std::size_t i = 0; i < changed; ++i) {
      const auto to = static_cast<std::size_t>(number_at(places.at(i), type, false));
      if (to >= count) throw BadGltf("changes an element of an accessor that does not exist");
      read(values, i, to);
    }
  }
  return result;
}

std::vector<std::uint32_t> GltfFile::indices(std::size_t accessor) const {
  const json& about = entry("accessors", accessor);
  const int component = about.at("componentType").get<int>();
  const auto count = about.at("count").get<std::size_t>();
  if (component != kUnsigned_byte && component != kUnsigned_short && component != kUnsigned_int)
    throw BadGltf("has indices that are not whole numbers");
  if (count > kMost_elements) throw BadGltf("has an accessor of more than 8000000 elements");
  const Layout layout = layout_of(about, component, 1, count);
  std::vector<std::uint32_t> result;
  result.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    result.push_back(static_cast<std::uint32_t>(number_at(layout.at(i), component, false)));
  return result;
}

}  // namespace flowscope
