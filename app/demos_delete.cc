// flowscope demos delete, restore, bin: away, back, and away for good.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "app/data_lock.h"
#include "app/demos_command.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

int delete_demos(const std::vector<std::string>& ids, const Context& context) {
  const DemoStore store = open_store(context);
  require_known_ids(store, ids, context);
  const FileLock lock = lock_data(context.data, "demos delete");
  for (const std::string& id : ids) store.remove(id);
  if (context.json) {
    print_json({{"deleted", ids}});
  } else {
    std::printf("%zu moved to the bin; demos restore brings them back\n", ids.size());
  }
  return 0;
}

int restore_demos(const std::vector<std::string>& ids, const Context& context) {
  const DemoStore store = open_store(context);
  for (const std::string& id : ids) {
    if (!store.bin().find(id)) {
      throw UsageError("ID: no demonstration \"" + id + "\" in the bin of " + context.data.string());
    }
  }
  const FileLock lock = lock_data(context.data, "demos restore");
  nlohmann::ordered_json restored = nlohmann::ordered_json::array();
  for (const std::string& id : ids) restored.push_back(store.restore(id));
  if (context.json) {
    print_json({{"restored", restored}});
  } else {
    std::printf("%zu restored\n", ids.size());
  }
  return 0;
}

int list_bin(const Context& context) {
  nlohmann::ordered_json demos = nlohmann::ordered_json::array();
  for (const BinEntry& entry : open_store(context).bin().list()) {
    nlohmann::ordered_json json = web::wire::to_json(entry.info);
    json["name"] = entry.name;
    json["removed"] = entry.removed;
    demos.push_back(std::move(json));
    if (context.json) continue;
    std::printf("%-46s removed %s %4d frames %7.1f kB  %s\n", entry.name.c_str(), entry.removed.c_str(),
                entry.info.frames, static_cast<double>(entry.info.bytes) / 1e3,
                entry.info.instruction.c_str());
  }
  if (context.json) print_json({{"demos", demos}});
  return 0;
}

int empty_bin(const Context& context) {
  const DemoStore store = open_store(context);
  const FileLock lock = lock_data(context.data, "demos bin empty");
  const std::vector<BinEntry> entries = store.bin().list();
  const auto bytes = std::accumulate(entries.begin(), entries.end(), std::uint64_t{0},
                                     [](auto sum, const BinEntry& entry) { return sum + entry.info.bytes; });
  store.bin().empty();
  if (context.json) {
    print_json({{"removed", entries.size()}, {"bytes", bytes}});
  } else {
    std::printf("%zu removed for good, %.1f MB\n", entries.size(), static_cast<double>(bytes) / 1e6);
  }
  return 0;
}

void add_with_ids(CLI::App& demos, Context& context, const char* name, const char* about,
                  int (*body)(const std::vector<std::string>&, const Context&)) {
  CLI::App* command = add_demos_part(demos, context, name, about);
  auto ids = std::make_shared<std::vector<std::string>>();
  command->add_option("ids", *ids, "Which ones")->required()->type_name("ID");
  set_body(*command, context, [=, &context] { return body(*ids, context); });
}

}  // namespace

void add_demos_delete(CLI::App& demos, Context& context) {
  add_with_ids(demos, context, "delete", "Move demonstrations to the bin", delete_demos);
  add_with_ids(demos, context, "restore",
               "Bring back from the bin what was removed, or replaced, last under an id", restore_demos);
  CLI::App* bin = demos.add_subcommand("bin", "What was removed or replaced");
  bin->require_subcommand(1);
  CLI::App* list = add_demos_part(*bin, context, "list", "What lies there, in the order in which it came");
  set_body(*list, context, [&context] { return list_bin(context); });
  CLI::App* empty = add_demos_part(*bin, context, "empty", "Remove all of it for good");
  set_body(*empty, context, [&context] { return empty_bin(context); });
}

}  // namespace flowscope::app
