// flowscope demos delete.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/demos_command.h"

namespace flowscope::app {
namespace {

int delete_demos(const std::vector<std::string>& ids, const Context& context) {
  const DemoStore store = open_store(context);
  require_known_ids(store, ids, context);
  for (const std::string& id : ids) store.remove(id);
  if (context.json) {
    print_json({{"deleted", ids}});
  } else {
    std::printf("%zu deleted\n", ids.size());
  }
  return 0;
}

}  // namespace

void add_demos_delete(CLI::App& demos, Context& context) {
  CLI::App* remove = add_demos_part(demos, context, "delete", "Delete demonstrations for good");
  auto ids = std::make_shared<std::vector<std::string>>();
  remove->add_option("ids", *ids, "Which ones")->required()->type_name("ID");
  set_body(*remove, context, [ids, &context] { return delete_demos(*ids, context); });
}

}  // namespace flowscope::app
