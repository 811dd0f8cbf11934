// flowscope demos list, show: what lies in the store.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/demos_command.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

namespace wire = web::wire;

int list_demos(const Context& context) {
  nlohmann::ordered_json demos = nlohmann::ordered_json::array();
  for (const DemoInfo& info : open_store(context).list()) {
    demos.push_back(wire::to_json(info));
    if (context.json) continue;
    std::printf("%-44s %-13s variation %2d  seed %-6llu %4d frames %3d keyframes %7.1f kB  %s%s\n",
                info.id.c_str(), robot_text(info.origin).c_str(), info.variation,
                static_cast<unsigned long long>(info.seed), info.frames, info.keyframes,
                static_cast<double>(info.bytes) / 1e3, info.unfinished() ? "(unfinished) " : "",
                info.instruction.c_str());
  }
  if (context.json) print_json({{"demos", demos}});
  return 0;
}

void print_origin(const DemoInfo& info) {
  const auto& scene = info.origin.scene;
  if (info.origin.robot.empty()) {
    std::printf(
        "robot        not recorded, nor whether it was a scene of --scene: the file is of an older build\n");
  } else {
    std::printf("robot        %s, %d joints\n", info.origin.robot.c_str(), info.origin.joints);
  }
  if (scene) {
    std::printf("scene        %s, robot %s%s%s%s%s\n", scene->scene.c_str(), scene->robot.c_str(),
                scene->key.empty() ? "" : ", key frame ", scene->key.c_str(),
                scene->folder.empty() ? "" : ", from ", scene->folder.c_str());
    std::printf("             SHA-256 %s\n", scene->scene_sha256.c_str());
  }
  if (info.success) std::printf("success      %s\n", *info.success ? "yes" : "no: saved unfinished");
}

void print_demo(const Demo& demo) {
  std::printf("%s\n", demo.info.id.c_str());
  std::printf("task         %s, variation %d, seed %llu\n", demo.info.task.c_str(), demo.info.variation,
              static_cast<unsigned long long>(demo.info.seed));
  print_origin(demo.info);
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

}  // namespace

void add_demos_list(CLI::App& demos, Context& context) {
  CLI::App* list = add_demos_part(demos, context, "list", "All demonstrations, the oldest first");
  set_body(*list, context, [&context] { return list_demos(context); });

  CLI::App* show = add_demos_part(demos, context, "show", "One demonstration with its keyframes");
  auto id = std::make_shared<std::string>();
  show->add_option("id", *id, "Which one")->required()->type_name("ID");
  set_body(*show, context, [id, &context] { return show_demo(*id, context); });
}

}  // namespace flowscope::app
