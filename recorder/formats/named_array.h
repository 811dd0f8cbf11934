// Arrays with names, element types and shapes: what NPZ and HDF5 files are made of.
#pragma once

#include <cstdint>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "recorder/bytes.h"

namespace flowscope {

enum class ArrayType { text, u8, i32, i64, f32, f64 };

template <Plain T>
constexpr ArrayType array_type_of() {
  if constexpr (std::is_same_v<T, double>) return ArrayType::f64;
  if constexpr (std::is_same_v<T, float>) return ArrayType::f32;
  if constexpr (std::is_same_v<T, std::uint8_t>) return ArrayType::u8;
  if constexpr (std::is_same_v<T, std::int32_t>) return ArrayType::i32;
  if constexpr (std::is_same_v<T, std::int64_t>) return ArrayType::i64;
}

/// Bytes of one element.
constexpr std::size_t element_bytes(ArrayType type) {
  switch (type) {
    case ArrayType::i32:
    case ArrayType::f32:
      return 4;
    case ArrayType::i64:
    case ArrayType::f64:
      return 8;
    default:
      return 1;
  }
}

/// Row-major. `text` is one string (UTF-8, no shape), its length is that of the data.
struct ArraySpec {
  ArrayType type = ArrayType::text;
  std::vector<std::uint64_t> shape;

  std::uint64_t bytes() const {
    return std::accumulate(shape.begin(), shape.end(), std::uint64_t{element_bytes(type)},
                           std::multiplies<>());
  }
  bool operator==(const ArraySpec&) const = default;
};

struct NamedArray {
  std::string name;  ///< parts separated by '/'
  ArraySpec spec;
  Bytes data;
  bool operator==(const NamedArray&) const = default;
};

inline NamedArray text_array(std::string name, const std::string& text) {
  return {std::move(name), {}, Bytes(text.begin(), text.end())};
}

template <Plain T>
NamedArray make_array(std::string name, std::vector<std::uint64_t> shape, std::span<const T> values) {
  NamedArray array{std::move(name), {array_type_of<T>(), std::move(shape)}, Bytes(values.size_bytes())};
  if (!values.empty()) std::memcpy(array.data.data(), values.data(), values.size_bytes());
  if (array.data.size() != array.spec.bytes())
    throw std::logic_error(array.name + ": shape and values differ");
  return array;
}

/// The array of that name, which must have this element type and shape (a text any length). Throws
/// std::runtime_error that names file and array. Nothing is allocated before type and shape have been
/// compared.
using FetchArray = std::function<NamedArray(const std::string& name, const ArraySpec& expected)>;

}  // namespace flowscope
