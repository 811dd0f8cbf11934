// flowscope demos trim: cuts idle starts and ends; what stood there before goes to the bin.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/data_lock.h"
#include "app/demo_tasks.h"
#include "app/demos_command.h"
#include "recorder/demo_trim.h"
#include "render/renderer.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

struct TrimCall {
  WhichDemos which;
  bool dry_run = false;
  DemoScenes scenes;
};

/// One renderer at a time: the demonstrations of a store mostly come task by task.
class Photographer {
 public:
  explicit Photographer(DemoTasks& tasks) : tasks_(tasks) {}
  /// With the cameras, and at the size, of the demonstration's first pictures.
  Observation operator()(const SceneState& state, const Demo& demo) {
    const std::shared_ptr<const Task> task = tasks_.get(demo.info);
    if (!renderer_ || task != task_) {
      renderer_.reset();
      renderer_.emplace(task->model(), state.scene);
      task_ = task;
    }
    const Observation& like = demo.start;
    std::vector<std::string> cameras;
    for (const View& view : like.views) cameras.push_back(view.camera.name);
    return renderer_->observe_all(state, cameras, like.views.empty() ? 0 : like.views.front().camera.width);
  }

 private:
  DemoTasks& tasks_;
  std::shared_ptr<const Task> task_;  ///< outlives the renderer, which draws its model
  std::optional<Renderer> renderer_;
};

Json trim_one(const DemoStore& store, const std::string& id, bool dry_run, Photographer& photographer) {
  const Demo demo = store.load(id);
  const FrameSpan span = busy_span(demo);
  const int at_start = span.first, at_end = demo.info.frames - 1 - span.last;
  if (at_start + at_end > 0 && !dry_run) {
    const Observe observe = [&](const SceneState& state) { return photographer(state, demo); };
    store.replace(id, trimmed(demo, span, observe));
  }
  return {{"id", id}, {"frames", demo.info.frames}, {"cut_start", at_start}, {"cut_end", at_end}};
}

void print_cut(const Json& demo) {
  const int at_start = demo.at("cut_start"), at_end = demo.at("cut_end");
  if (at_start + at_end == 0) return;
  std::printf("%-44s %4d frames: %d cut at the start, %d at the end\n",
              demo.at("id").get<std::string>().c_str(), demo.at("frames").get<int>(), at_start, at_end);
}

int trim(const TrimCall& call, const Context& context) {
  const DemoStore store = open_store(context);
  const std::vector<std::string> ids = ids_of(call.which, store, context);
  std::optional<FileLock> lock;
  if (!call.dry_run) lock.emplace(lock_data(context.data, "demos trim"));
  DemoTasks tasks(call.scenes);
  Photographer photographer(tasks);
  Json demos = Json::array();
  int changed = 0, cut_frames = 0, unreadable = 0;
  for (const std::string& id : ids) {
    try {
      const Json demo = trim_one(store, id, call.dry_run, photographer);
      const int cut = demo.at("cut_start").get<int>() + demo.at("cut_end").get<int>();
      changed += cut > 0;
      cut_frames += cut;
      demos.push_back(demo);
    } catch (const BadDemo& error) {  // one bad file must not keep the others from being trimmed
      std::fprintf(stderr, "left as it is: %s\n", error.what());
      ++unreadable;
    } catch (const RefusedDemo& error) {
      std::fprintf(stderr, "%s is left as it is: cut, it would be bad: %s\n", id.c_str(), error.what());
      ++unreadable;
    }
  }
  if (context.json) {
    print_json({{"dry_run", call.dry_run}, {"changed", changed}, {"cut", cut_frames}, {"demos", demos}});
  } else {
    for (const Json& demo : demos) print_cut(demo);
    std::printf("%d of %zu %s by %d frames%s\n", changed, ids.size(),
                call.dry_run ? "would get shorter" : "got shorter", cut_frames,
                changed > 0 && !call.dry_run ? "; the old ones are in the bin" : "");
  }
  return unreadable == 0 ? 0 : 1;
}

}  // namespace

void add_demos_trim(CLI::App& demos, Context& context) {
  CLI::App* command = add_demos_part(demos, context, "trim",
                                     "Cut the frames at start and end in which nothing moves; what was there "
                                     "before goes to the bin");
  auto call = std::make_shared<TrimCall>();
  add_which_option(*command, call->which);
  command->add_flag("--dry-run", call->dry_run, "Only say what would be cut");
  add_demo_scene_options(*command, call->scenes);
  add_egl_option(*command, context);
  set_body(*command, context, [call, &context] { return trim(*call, context); });
}

}  // namespace flowscope::app
