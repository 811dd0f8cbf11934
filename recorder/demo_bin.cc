#include "recorder/demo_bin.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <ctime>
#include <tuple>

#include "recorder/atomic_file.h"
#include "recorder/demo_file.h"

namespace flowscope {
namespace {

constexpr const char* extension = ".demo";

/// A file "<id>.<n>.demo"; the number is 0 for any other name.
struct Name {
  std::string id;
  int number = 0;
};

Name parse_name(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  const std::size_t dot = stem.rfind('.');
  Name name{stem.substr(0, dot)};
  if (file.extension() != extension || dot == std::string::npos || dot == 0) return name;
  const char* end = stem.data() + stem.size();
  const auto [rest, error] = std::from_chars(stem.data() + dot + 1, end, name.number);
  if (error != std::errc() || rest != end) name.number = 0;
  return name;
}

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code none_yet;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none_yet)) {
    if (parse_name(entry.path()).number > 0) files.push_back(entry.path());
  }
  return files;
}

int last_number(const std::filesystem::path& folder, const std::string& id) {
  int last = 0;
  for (const auto& file : files_of(folder)) {
    if (const Name name = parse_name(file); name.id == id) last = std::max(last, name.number);
  }
  return last;
}

std::filesystem::path path_of(const std::filesystem::path& folder, const Name& name) {
  return folder / (name.id + "." + std::to_string(name.number) + extension);
}

std::string iso_8601(std::filesystem::file_time_type time) {
  const auto system = std::chrono::file_clock::to_sys(time);
  const std::time_t seconds =
      std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::seconds>(system));
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace

void DemoBin::put(const std::filesystem::path& file) const {
  std::filesystem::create_directories(folder_);
  Name name{file.stem().string(), last_number(folder_, file.stem().string()) + 1};
  while (!move_to_new_name(file, path_of(folder_, name))) ++name.number;
  // A demonstration never changes, so its time stamp is free to say when it came here.
  std::error_code not_worth_failing_for;
  std::filesystem::last_write_time(path_of(folder_, name), std::filesystem::file_time_type::clock::now(),
                                   not_worth_failing_for);
}

void DemoBin::put_copy(const std::filesystem::path& file) const {
  std::filesystem::create_directories(folder_);
  Name name{file.stem().string(), last_number(folder_, file.stem().string()) + 1};
  const Bytes bytes = read_demo_bytes(file);
  while (!write_new_file_atomically(path_of(folder_, name), bytes)) ++name.number;
}

std::optional<std::filesystem::path> DemoBin::find(const std::string& id_or_name) const {
  std::optional<std::filesystem::path> found;
  int newest = 0;
  for (const auto& file : files_of(folder_)) {
    const Name name = parse_name(file);
    if (file.stem() == id_or_name) return file;
    if (name.id != id_or_name || name.number <= newest) continue;
    newest = name.number;
    found = file;
  }
  return found;
}

std::vector<BinEntry> DemoBin::list() const {
  std::vector<std::filesystem::path> files = files_of(folder_);
  std::vector<BinEntry> entries;
  for (const auto& file : files) {
    BinEntry& entry = entries.emplace_back();
    try {
      entry.info = read_demo_info(file);
    } catch (const BadDemo&) {
      std::error_code ignored;
      entry.info.bytes = std::filesystem::file_size(file, ignored);
    }
    entry.name = file.stem().string();
    entry.info.id = parse_name(file).id;
    std::error_code gone;
    entry.removed = iso_8601(std::filesystem::last_write_time(file, gone));
  }
  std::sort(entries.begin(), entries.end(), [](const BinEntry& a, const BinEntry& b) {
    return std::tie(a.removed, a.name) < std::tie(b.removed, b.name);
  });
  return entries;
}

void DemoBin::empty() const {
  for (const auto& file : files_of(folder_)) std::filesystem::remove(file);
}

}  // namespace flowscope
