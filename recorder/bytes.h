// Little-endian byte blocks and their compression, for the demonstration file.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <vector>

namespace flowscope {

static_assert(std::endian::native == std::endian::little, "files hold little-endian numbers");

using Bytes = std::vector<std::uint8_t>;

template <typename T>
concept Plain = std::is_arithmetic_v<T>;

template <Plain T>
void put(Bytes& out, T value) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
  out.insert(out.end(), first, first + sizeof(T));
}

template <Plain T>
void put_all(Bytes& out, std::span<const T> values) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(values.data());
  out.insert(out.end(), first, first + values.size_bytes());
}

/// Reads front to back; std::out_of_range past the end.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > rest_.size()) throw std::out_of_range("ends too early");
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  template <Plain T>
  T get() {
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  template <Plain T>
  void get_all(std::span<T> values) {
    const auto taken = take(values.size_bytes());
    if (!taken.empty()) std::memcpy(values.data(), taken.data(), taken.size());
  }
  std::size_t left() const { return rest_.size(); }

 private:
  std::span<const std::uint8_t> rest_;
};

/// zlib. `inflate_bytes` throws std::runtime_error unless exactly `raw_size` bytes come out; it never
/// allocates more.
Bytes deflate_bytes(std::span<const std::uint8_t> raw);
Bytes inflate_bytes(std::span<const std::uint8_t> packed, std::size_t raw_size);

}  // namespace flowscope
