// flowscope demos merge: the demonstrations of other data folders, each once.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "app/data_lock.h"
#include "app/demos_command.h"
#include "recorder/demo_check.h"
#include "recorder/demo_file.h"
#include "recorder/sha256.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

struct Merged {
  Json copied = Json::array(), renamed = Json::array(), broken = Json::array();
  int identical = 0;
};

/// Another folder's files, unreadable ones too: those are named, not passed over.
std::vector<std::filesystem::path> demo_files_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "demos")) {
    const auto& path = entry.path();
    if (path.extension() == ".demo" && !path.filename().string().starts_with('.')) files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

void require_other_folders(const std::vector<std::string>& folders, const Context& context) {
  for (const std::string& folder : folders) {
    if (!std::filesystem::is_directory(std::filesystem::path(folder) / "demos")) {
      throw UsageError("DIR: " + folder + " has no demonstrations (no folder demos in it)");
    }
    if (std::filesystem::exists(context.data) && std::filesystem::equivalent(folder, context.data)) {
      throw UsageError("DIR: " + folder + " is --data itself");
    }
  }
}

void merge_file(const std::filesystem::path& file, const DemoStore& store, std::set<std::string>& known,
                Merged& merged) {
  const std::string id = file.stem().string();
  try {
    const Bytes bytes = read_demo_bytes(file);
    if (known.contains(sha256_hex(bytes))) {
      ++merged.identical;
      return;
    }
    const std::string problem = find_incoherence(decode_demo(bytes, file, DemoParts::all));
    if (!problem.empty()) throw BadDemo(file.string() + ": " + problem);
    const std::string got = store.adopt(bytes, id);
    known.insert(sha256_hex(bytes));
    merged.copied.push_back(got);
    if (got != id) merged.renamed.push_back({{"from", file.string()}, {"id", got}});
  } catch (const BadDemo& error) {
    std::fprintf(stderr, "left out: %s\n", error.what());
    merged.broken.push_back({{"file", file.string()}, {"problem", error.what()}});
  } catch (const std::out_of_range& error) {  // a name that is no id
    std::fprintf(stderr, "left out: %s: %s\n", file.c_str(), error.what());
    merged.broken.push_back({{"file", file.string()}, {"problem", error.what()}});
  }
}

int merge(const std::vector<std::string>& folders, const Context& context) {
  require_other_folders(folders, context);
  const FileLock lock = lock_data(context.data, "demos merge");
  const DemoStore store(context.data);
  std::set<std::string> known;
  for (const auto& file : demo_files_of(context.data)) known.insert(sha256_hex(read_demo_bytes(file)));
  Merged merged;
  for (const std::string& folder : folders) {
    for (const auto& file : demo_files_of(folder)) merge_file(file, store, known, merged);
  }
  if (context.json) {
    print_json({{"copied", merged.copied},
                {"identical", merged.identical},
                {"renamed", merged.renamed},
                {"broken", merged.broken}});
  } else {
    for (const auto& [what, value] : merged.renamed.items()) {
      std::printf("%s is now %s\n", value.at("from").get<std::string>().c_str(),
                  value.at("id").get<std::string>().c_str());
    }
    std::printf("%zu copied, %d were there already, %zu left out as broken\n", merged.copied.size(),
                merged.identical, merged.broken.size());
  }
  return merged.broken.empty() ? 0 : 1;
}

}  // namespace

void add_demos_merge(CLI::App& demos, Context& context) {
  CLI::App* command = add_demos_part(
      demos, context, "merge",
      "Copy the demonstrations of other data folders in, each content once; exit code 1 when some are broken "
      "and were left out");
  auto folders = std::make_shared<std::vector<std::string>>();
  command->add_option("folders", *folders, "Data folders to copy from")->required()->type_name("DIR");
  set_body(*command, context, [folders, &context] { return merge(*folders, context); });
}

}  // namespace flowscope::app
