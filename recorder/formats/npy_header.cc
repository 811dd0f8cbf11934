#include "recorder/formats/npy_header.h"

namespace flowscope {
namespace {

std::string dtype_of(ArrayType type, std::uint64_t data_bytes) {
  switch (type) {
    case ArrayType::u8:
      return "|u1";
    case ArrayType::i32:
      return "<i4";
    case ArrayType::i64:
      return "<i8";
    case ArrayType::f32:
      return "<f4";
    case ArrayType::f64:
      return "<f8";
    case ArrayType::text:
      break;
  }
  return "|S" + std::to_string(data_bytes);
}

}  // namespace

std::string npy_header(const ArraySpec& spec, std::uint64_t data_bytes) {
  std::string shape;
  for (const std::uint64_t n : spec.shape) shape += std::to_string(n) + ", ";
  if (spec.shape.size() > 1) shape.resize(shape.size() - 2);  // numpy writes (2, 3) and (2,)
  if (spec.shape.size() == 1) shape.pop_back();
  std::string text = "{'descr': '" + dtype_of(spec.type, data_bytes) +
                     "', 'fortran_order': False, 'shape': (" + shape + "), }";
  constexpr std::size_t prelude = 10, alignment = 64;
  text.append((alignment - (prelude + text.size() + 1) % alignment) % alignment, ' ');
  text += '\n';
  const auto length = static_cast<std::uint16_t>(text.size());
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(length & 0xff) +
         static_cast<char>(length >> 8) + text;
}

}  // namespace flowscope
