#include "recorder/formats/npz_demos.h"

#include "recorder/formats/demo_arrays.h"

namespace flowscope {
namespace {

std::string group_of(std::int64_t index) { return "demo_" + std::to_string(index) + "/"; }

}  // namespace

void NpzDemoWriter::add(const Demo& demo) {
  for (NamedArray& array : arrays_of(demo, ArrayParts::all)) {
    array.name = group_of(count_) + array.name;
    file_.add(array);
  }
  ++count_;
}

void NpzDemoWriter::finish(const FileCheck& check) {
  file_.add(make_array<std::int64_t>("demos", {1}, {&count_, 1}));
  file_.finish(check);
}

NpzDemoReader::NpzDemoReader(const std::filesystem::path& file) : path_(file), file_(file) {
  if (!file_.has("demos")) {
    throw std::runtime_error(file.string() + ": was not written by flowscope: it has no array demos");
  }
  const NamedArray demos = file_.read("demos", {ArrayType::i64, {1}});
  const auto count = ByteReader(demos.data).get<std::int64_t>();
  while (count_ < count && file_.has(group_of(count_) + "header")) ++count_;
  if (count_ != count)
    throw std::runtime_error(file.string() + ": has no array " + group_of(count_) + "header");
}

Demo NpzDemoReader::read(int index) const {
  const std::string group = group_of(index);
  return demo_from_arrays(
      [&](const std::string& name, const ArraySpec& expected) { return file_.read(group + name, expected); },
      ArrayParts::all, path_.string() + ": " + group);
}

}  // namespace flowscope
