// Python pickles (protocol 3) of plain values, numpy arrays and objects: enough for datasets whose readers
// unpickle.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "recorder/formats/named_array.h"

namespace flowscope {

/// One value per file. Values are written in order; a list or a dictionary takes a function that writes its
/// content (for a dictionary: key, value, key, value, …).
class PickleWriter {
 public:
  PickleWriter();

  void none();
  void boolean(bool value);
  void integer(std::int64_t value);
  void number(double value);
  void text(const std::string& value);
  /// numpy.ndarray of the array's type and shape.
  void array(const NamedArray& value);
  void list(const std::function<void()>& items);
  void dictionary(const std::function<void()>& entries);
  /// An object of a class that the reader can import, made without calling its constructor: `attributes`
  /// writes its dictionary.
  void object(const std::string& module, const std::string& name, const std::function<void()>& attributes);

  Bytes finish();

 private:
  void op(char code) { put(bytes_, code); }
  void global(const std::string& module, const std::string& name);
  void raw(const Bytes& value);
  /// What occurs again and again is written once and then referred to.
  void once(const std::string& key, const std::function<void()>& write);

  Bytes bytes_;
  std::map<std::string, std::uint32_t> known_;
};

}  // namespace flowscope
