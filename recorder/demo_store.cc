#include "recorder/demo_store.h"

#include <algorithm>
#include <chrono>
#include <ctime>

#include "recorder/atomic_file.h"
#include "recorder/demo_check.h"
#include "recorder/demo_file.h"
#include "recorder/demo_twin.h"

namespace flowscope {
namespace {

constexpr const char* extension = ".demo";
constexpr std::size_t max_id_length = 64;

bool is_id_character(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

bool is_id(const std::string& id) {
  return !id.empty() && id.size() <= max_id_length && std::all_of(id.begin(), id.end(), is_id_character);
}

std::string format_utc(std::chrono::system_clock::time_point time, const char* format) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  const std::size_t length = std::strftime(text, sizeof(text), format, &parts);
  return {text, length};
}

std::string iso_8601(std::chrono::system_clock::time_point time) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
  const std::string fraction = std::to_string(1000 + ms % 1000).substr(1);
  return format_utc(time, "%Y-%m-%dT%H:%M:%S.") + fraction + "Z";
}

/// "20261122-101530-push_buttons-0007": sorts by time, and the number sets apart what one second brings.
std::string make_id(std::chrono::system_clock::time_point time, const std::string& task, int number) {
  std::string name;
  for (const char c : task.substr(0, 40)) name += is_id_character(c) ? c : '_';
  const std::string digits = std::to_string(number);
  return format_utc(time, "%Y%m%d-%H%M%S-") + (name.empty() ? "demo" : name) + "-" +
         std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

/// Every demonstration file of the folder, in order of name.
std::vector<std::filesystem::path> demo_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() == extension && !path.filename().string().starts_with('.')) files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

[[noreturn]] void throw_unknown(const std::filesystem::path& file) {
  throw std::out_of_range("no demonstration \"" + file.stem().string() + "\" in " +
                          file.parent_path().string());
}

Demo load_parts(const std::filesystem::path& file, DemoParts parts) {
  if (!std::filesystem::exists(file)) throw_unknown(file);
  return decode_demo(read_demo_bytes(file), file, parts);
}

}  // namespace

DemoStore::DemoStore(std::filesystem::path data_dir) : dir_(std::move(data_dir) / "demos") {
  std::filesystem::create_directories(dir_);
  remove_stale_temporaries(dir_);
}

std::string DemoStore::save(const Demo& demo) const {
  const auto now = std::chrono::system_clock::now();
  Demo stamped = demo;
  if (stamped.info.created.empty()) stamped.info.created = iso_8601(now);
  const Bytes bytes = encode_demo(stamped);
  const std::lock_guard lock(*taking_in_);
  require_good(bytes);
  for (int number = 1;; ++number) {
    const std::string id = make_id(now, demo.info.task, number);
    if (write_new_file_atomically(path(id), bytes)) return id;
  }
}

void DemoStore::require_good(const Bytes& bytes, const std::string& instead_of) const {
  Demo demo;
  try {  // as it will be read
    demo = decode_demo(bytes, "demonstration", DemoParts::all);
  } catch (const BadDemo& error) {
    throw RefusedDemo(error.what());
  }
  if (const std::string problem = find_incoherence(demo); !problem.empty()) throw RefusedDemo(problem);
  std::vector<std::filesystem::path> others = demo_files(dir_);
  std::erase_if(others, [&](const auto& file) { return file.stem() == instead_of; });
  if (const auto twin = find_twin(demo, others))
    throw RefusedDemo(twin_text(twin->stem().string()), twin->stem().string());
}

std::vector<DemoInfo> DemoStore::list(std::vector<DemoProblem>* unreadable) const {
  std::vector<DemoInfo> infos;
  for (const std::filesystem::path& file : demo_files(dir_)) {
    if (!is_id(file.stem().string())) continue;
    try {
      infos.push_back(read_demo_info(file));
    } catch (const BadDemo& error) {  // one bad file must not hide the good ones
      if (unreadable != nullptr) unreadable->push_back({file.stem().string(), error.what()});
    }
  }
  std::stable_sort(infos.begin(), infos.end(),
                   [](const DemoInfo& a, const DemoInfo& b) { return a.created < b.created; });
  return infos;
}

Demo DemoStore::load(const std::string& id) const { return load_parts(path(id), DemoParts::all); }

Demo DemoStore::load_keyframes(const std::string& id) const {
  return load_parts(path(id), DemoParts::without_states);
}

void DemoStore::remove(const std::string& id) const {
  if (!std::filesystem::exists(path(id))) throw_unknown(path(id));
  bin().put(path(id));
}

std::string DemoStore::restore(const std::string& id_or_name) const {
  const auto file = bin().find(id_or_name);
  if (!file) {
    throw std::out_of_range("no demonstration \"" + id_or_name + "\" in the bin of " +
                            dir_.parent_path().string());
  }
  const std::string id = file->stem().stem().string();
  while (!move_to_new_name(*file, path(id))) bin().put(path(id));
  return id;
}

void DemoStore::replace(const std::string& id, const Demo& demo) const {
  if (!std::filesystem::exists(path(id))) throw_unknown(path(id));
  const Bytes bytes = encode_demo(demo);
  const std::lock_guard lock(*taking_in_);
  require_good(bytes, id);
  NewFile file(path(id));
  file.write(bytes);
  bin().put_copy(path(id));
  file.commit();
}

std::string DemoStore::adopt(const Bytes& bytes, const std::string& wanted_id) const {
  decode_demo(bytes, path(wanted_id), DemoParts::all);
  const std::lock_guard lock(*taking_in_);
  require_good(bytes);
  std::string id = wanted_id;
  for (int number = 2; !write_new_file_atomically(path(id), bytes); ++number) {
    const std::string ending = "-" + std::to_string(number);
    id = wanted_id.substr(0, max_id_length - ending.size()) + ending;
  }
  return id;
}

std::vector<DemoProblem> DemoStore::check(int* checked) const {
  std::vector<DemoProblem> problems;
  DemoJudge judge;
  const std::vector<std::filesystem::path> files = demo_files(dir_);
  for (const std::filesystem::path& file : files) {
    const std::string id = file.stem().string();
    if (!is_id(id)) {
      problems.push_back({id, file.string() + ": its name is not a demonstration id"});
      continue;
    }
    try {
      const Demo demo = decode_demo(read_demo_bytes(file), file, DemoParts::all);
      const std::string problem = judge.find_problem(id, demo);
      if (!problem.empty()) problems.push_back({id, file.string() + ": " + problem});
    } catch (const BadDemo& error) {
      problems.push_back({id, error.what()});
    }
  }
  if (checked != nullptr) *checked = static_cast<int>(files.size());
  return problems;
}

std::filesystem::path DemoStore::path(const std::string& id) const {
  if (!is_id(id)) throw std::out_of_range("\"" + id + "\" is not a demonstration id");
  return dir_ / (id + extension);
}

}  // namespace flowscope
