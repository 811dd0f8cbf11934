// flowscope demos: what lies in the store, whether it is whole, and removing from it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "recorder/demo_store.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

namespace wire = web::wire;

DemoStore open_store(const Context& context) { return DemoStore(existing_data(context)); }

/// Runs `action`; an id that the store does not know is a wrong call.
template <typename Action>
auto with_known_id(Action&& action) {
  try {
    return action();
  } catch (const std::out_of_range& error) {
    throw UsageError(std::string("ID: ") + error.what());
  }
}

int list_demos(const Context& context) {
  nlohmann::ordered_json demos = nlohmann::ordered_json::array();
  for (const DemoInfo& info : open_store(context).list()) {
    demos.push_back(wire::to_json(info));
    if (context.json) continue;
    std::printf("%-44s variation %2d  seed %-6llu %4d frames %3d keyframes %7.1f kB  %s\n", info.id.c_str(),
                info.variation, static_cast<unsigned long long>(info.seed), info.frames, info.keyframes,
                static_cast<double>(info.bytes) / 1e3, info.instruction.c_str());
  }
  if (context.json) print_json({{"demos", demos}});
  return 0;
}

void print_demo(const Demo& demo) {
  std::printf("%s\n", demo.info.id.c_str());
  std::printf("task         %s, variation %d, seed %llu\n", demo.info.task.c_str(), demo.info.variation,
              static_cast<unsigned long long>(demo.info.seed));
  std::printf("created      %s\n", demo.info.created.c_str());
  std::printf("simulator    %s\n", demo.simulator.empty() ? "not recorded" : demo.simulator.c_str());
  for (const std::string& instruction : demo.instructions) {
    std::printf("instruction  %s\n", instruction.c_str());
  }
  std::printf("frames       %d, %.2f s\n", demo.info.frames,
              demo.frames.back().time_s - demo.frames.front().time_s);
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    const Keyframe& keyframe = demo.keyframes[k];
    const Pose& pose = keyframe.action.world_from_tool;
    const Eigen::Vector4d q = pose.wxyz();
    std::printf(
        "keyframe %-3zu frame %4d  position %.4f %.4f %.4f m  quaternion %.4f %.4f %.4f %.4f  gripper %s\n",
        k, keyframe.frame, pose.position.x(), pose.position.y(), pose.position.z(), q[0], q[1], q[2], q[3],
        keyframe.action.open() ? "open" : "closed");
  }
}

int show_demo(const std::string& id, const Context& context) {
  const Demo demo = with_known_id([&] { return open_store(context).load_keyframes(id); });
  if (context.json) {
    print_json(wire::demo_detail(demo));
  } else {
    print_demo(demo);
  }
  return 0;
}

int check_demos(const Context& context) {
  int checked = 0;
  nlohmann::ordered_json bad = nlohmann::ordered_json::array();
  for (const DemoProblem& problem : open_store(context).check(&checked)) {
    std::fprintf(stderr, "%s\n", problem.problem.c_str());
    bad.push_back({{"id", problem.id}, {"problem", problem.problem}});
  }
  if (context.json) {
    print_json({{"checked", checked}, {"bad", bad}});
  } else {
    std::printf("%d checked, %zu bad\n", checked, bad.size());
  }
  return bad.empty() ? 0 : 1;
}

int delete_demos(const std::vector<std::string>& ids, const Context& context) {
  const DemoStore store = open_store(context);
  // All ids first: a mistyped one must not leave half of the work done.
  for (const std::string& id : ids) {
    if (!with_known_id([&] { return std::filesystem::exists(store.path(id)); })) {
      throw UsageError("ID: no demonstration \"" + id + "\" in " + context.data.string());
    }
  }
  for (const std::string& id : ids) store.remove(id);
  if (context.json) {
    print_json({{"deleted", ids}});
  } else {
    std::printf("%zu deleted\n", ids.size());
  }
  return 0;
}

}  // namespace

void add_demos_command(CLI::App& root, Context& context) {
  CLI::App* demos = root.add_subcommand("demos", "List, show, check or delete demonstrations");
  demos->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    CLI::App* command = demos->add_subcommand(name, description);
    add_data_option(*command, context);
    add_json_option(*command, context);
    return command;
  };
  CLI::App* list = add("list", "All demonstrations, the oldest first");
  set_body(*list, context, [&context] { return list_demos(context); });

  CLI::App* show = add("show", "One demonstration with its keyframes");
  auto id = std::make_shared<std::string>();
  show->add_option("id", *id, "Which one")->required()->type_name("ID");
  set_body(*show, context, [id, &context] { return show_demo(*id, context); });

  CLI::App* check = add("check", "Verify every checksum and the content; exit code 1 when any is bad");
  set_body(*check, context, [&context] { return check_demos(context); });

  CLI::App* remove = add("delete", "Delete demonstrations for good");
  auto ids = std::make_shared<std::vector<std::string>>();
  remove->add_option("ids", *ids, "Which ones")->required()->type_name("ID");
  set_body(*remove, context, [ids, &context] { return delete_demos(*ids, context); });
}

}  // namespace flowscope::app
