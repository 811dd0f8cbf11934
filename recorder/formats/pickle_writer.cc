#include "recorder/formats/pickle_writer.h"

#include <algorithm>

namespace flowscope {
namespace {

// Opcodes, by the names of Python's pickletools.
constexpr char proto = '\x80', stop = '.', mark = '(', none_op = 'N', new_true = '\x88', new_false = '\x89',
               long1 = '\x8a', bin_float = 'G', bin_unicode = 'X', bin_bytes = 'B', global_op = 'c',
               empty_tuple = ')', tuple_op = 't', tuple3 = '\x87', empty_list = ']', appends = 'e',
               empty_dict = '}', set_items = 'u', new_object = '\x81', reduce_op = 'R', build = 'b',
               long_put = 'r', long_get = 'j';

const char* dtype_of(ArrayType type) {
  switch (type) {
    case ArrayType::u8:
      return "u1";
    case ArrayType::i32:
      return "i4";
    case ArrayType::i64:
      return "i8";
    case ArrayType::f32:
      return "f4";
    case ArrayType::f64:
      return "f8";
    case ArrayType::text:
      break;
  }
  throw std::logic_error("a text is no array");
}

}  // namespace

PickleWriter::PickleWriter() {
  op(proto);
  op('\x03');
}

void PickleWriter::none() { op(none_op); }

void PickleWriter::boolean(bool value) { op(value ? new_true : new_false); }

void PickleWriter::integer(std::int64_t value) {
  op(long1);
  put(bytes_, static_cast<std::uint8_t>(sizeof(value)));
  put(bytes_, value);
}

void PickleWriter::number(double value) {
  op(bin_float);  // the one number here that is big-endian
  Bytes one;
  put(one, value);
  bytes_.insert(bytes_.end(), one.rbegin(), one.rend());
}

void PickleWriter::text(const std::string& value) {
  once("text " + value, [&] {
    op(bin_unicode);
    put(bytes_, static_cast<std::uint32_t>(value.size()));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
  });
}

void PickleWriter::raw(const Bytes& value) {
  op(bin_bytes);
  put(bytes_, static_cast<std::uint32_t>(value.size()));
  bytes_.insert(bytes_.end(), value.begin(), value.end());
}

void PickleWriter::global(const std::string& module, const std::string& name) {
  once("global " + module + " " + name, [&] {
    op(global_op);
    const std::string line = module + "\n" + name + "\n";
    bytes_.insert(bytes_.end(), line.begin(), line.end());
  });
}

void PickleWriter::once(const std::string& key, const std::function<void()>& write) {
  const auto [place, is_new] = known_.try_emplace(key, static_cast<std::uint32_t>(known_.size()));
  const std::uint32_t index = place->second;
  if (is_new) write();
  op(is_new ? long_put : long_get);
  put(bytes_, index);
}

void PickleWriter::array(const NamedArray& value) {
  global("numpy.core.multiarray", "_reconstruct");
  once("empty array", [&] {
    global("numpy", "ndarray");
    op(mark);
    integer(0);
    op(tuple_op);
    raw({'b'});
    op(tuple3);
  });
  op(reduce_op);
  op(mark);  // its state: version, shape, dtype, not Fortran's order, bytes
  integer(1);
  op(mark);
  for (const std::uint64_t n : value.spec.shape) integer(static_cast<std::int64_t>(n));
  op(tuple_op);
  const std::string type = dtype_of(value.spec.type);
  once("dtype " + type, [&] {
    global("numpy", "dtype");
    text(type);
    boolean(false);
    boolean(true);
    op(tuple3);
    op(reduce_op);
    op(mark);
    integer(3);
    text(element_bytes(value.spec.type) == 1 ? "|" : "<");
    for (int i = 0; i < 3; ++i) none();
    integer(-1);
    integer(-1);
    integer(0);
    op(tuple_op);
    op(build);
  });
  boolean(false);
  raw(value.data);
  op(tuple_op);
  op(build);
}

void PickleWriter::list(const std::function<void()>& items) {
  op(empty_list);
  op(mark);
  items();
  op(appends);
}

void PickleWriter::dictionary(const std::function<void()>& entries) {
  op(empty_dict);
  op(mark);
  entries();
  op(set_items);
}

void PickleWriter::object(const std::string& module, const std::string& name,
                          const std::function<void()>& attributes) {
  global(module, name);
  op(empty_tuple);
  op(new_object);
  dictionary(attributes);
  op(build);
}

Bytes PickleWriter::finish() {
  op(stop);
  return std::move(bytes_);
}

}  // namespace flowscope
