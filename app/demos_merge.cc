// flowscope demos merge: the demonstrations of other data folders, each once.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "app/data_lock.h"
#include "app/demo_contents.h"
#include "app/demos_command.h"
#include "recorder/demo_file.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

struct Merged {
  Json copied = Json::array(), renamed = Json::array(), broken = Json::array();
  int identical = 0;
};

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

void merge_file(const std::filesystem::path& file, const DemoStore& store, DemoContents& contents,
                Merged& merged) {
  const std::string id = file.stem().string();
  try {
    const Bytes bytes = read_demo_bytes(file);
    if (contents.has(bytes)) {
      ++merged.identical;
      return;
    }
    const std::string got = store.adopt(bytes, id);
    contents.add(bytes);
    merged.copied.push_back(got);
    if (got != id) merged.renamed.push_back({{"from", file.string()}, {"id", got}});
  } catch (const RefusedDemo& error) {
    const std::string problem = file.string() + ": " + error.what();
    std::fprintf(stderr, "left out: %s\n", problem.c_str());
    if (!error.twin.empty()) {
      ++merged.identical;
    } else {
      merged.broken.push_back({{"file", file.string()}, {"problem", problem}});
    }
  } catch (const BadDemo& error) {
    std::fprintf(stderr, "left out: %s\n", error.what());
    merged.broken.push_back({{"file", file.string()}, {"problem", error.what()}});
  } catch (const std::out_of_range& error) {  // a name that is no id
    std::fprintf(stderr, "left out: %s: %s\n", file.c_str(), error.what());
    merged.broken.push_back({{"file", file.string()}, {"problem", error.what()}});
  }
}

/// How many of each robot the folder holds now: each file says what it is, so they may lie together, but one
/// policy learns from one of them.
std::map<std::string, int> robots_of(const DemoStore& store) {
  std::map<std::string, int> robots;
  for (const DemoInfo& info : store.list()) ++robots[robot_text(info.origin)];
  return robots;
}

void print_robots(const std::map<std::string, int>& robots) {
  const std::size_t unknown = robots.contains(robot_text({})) ? 1 : 0;
  if (robots.size() - unknown < 2) return;
  std::printf("several robots lie here now; train takes one of them (--tasks):");
  for (const auto& [robot, count] : robots) std::printf(" %d %s", count, robot.c_str());
  std::printf("\n");
}

int merge(const std::vector<std::string>& folders, const Context& context) {
  require_other_folders(folders, context);
  const FileLock lock = lock_data(context.data, "demos merge");
  const DemoStore store(context.data);
  DemoContents contents(store);
  Merged merged;
  for (const std::string& folder : folders) {
    for (const auto& file : demo_files_of(folder)) merge_file(file, store, contents, merged);
  }
  if (context.json) {
    print_json({{"copied", merged.copied},
                {"identical", merged.identical},
                {"renamed", merged.renamed},
                {"robots", robots_of(store)},
                {"broken", merged.broken}});
  } else {
    for (const auto& [what, value] : merged.renamed.items()) {
      std::printf("%s is now %s\n", value.at("from").get<std::string>().c_str(),
                  value.at("id").get<std::string>().c_str());
    }
    std::printf("%zu copied, %d were there already, %zu left out as broken\n", merged.copied.size(),
                merged.identical, merged.broken.size());
    print_robots(robots_of(store));
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
