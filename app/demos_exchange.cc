// flowscope demos export, import: robomimic's HDF5, RLBench's folders, NPZ.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/data_lock.h"
#include "app/demos_command.h"
#include "app/exchange.h"
#include "app/progress.h"

namespace flowscope::app {
namespace {

/// Where to or from: exactly one of the three.
struct Place {
  std::string hdf5, rlbench, npz;

  /// Throws UsageError unless one of them is given.
  void require_one() const {
    if (!hdf5.empty() + !rlbench.empty() + !npz.empty() != 1) {
      throw UsageError("--hdf5, --rlbench or --npz says which format and where (one of them)");
    }
  }
  ExchangeFormat format() const {
    if (!hdf5.empty()) return ExchangeFormat::hdf5;
    return rlbench.empty() ? ExchangeFormat::npz : ExchangeFormat::rlbench;
  }
  std::filesystem::path path() const { return !hdf5.empty() ? hdf5 : rlbench.empty() ? npz : rlbench; }
};

struct ExportCall {
  Place place;
  std::vector<std::string> ids;
  DemoScenes scenes;
  std::string task, pictures;
  bool all_variations = false;
};

void add_place(CLI::App& command, Place& place) {
  command.add_option("--hdf5", place.hdf5, "One HDF5 file in robomimic's layout")->type_name("FILE");
  command.add_option("--rlbench", place.rlbench, "A folder in RLBench's layout")->type_name("DIR");
  command.add_option("--npz", place.npz, "One file of numpy arrays")->type_name("FILE");
}

std::vector<std::string> chosen_ids(const ExportCall& call, const DemoStore& store, const Context& context) {
  require_known_ids(store, call.ids, context);
  std::vector<std::string> ids;
  for (const DemoInfo& info : store.list()) {
    if (call.task.empty() || info.task == call.task) ids.push_back(info.id);
  }
  if (!call.ids.empty()) {
    if (!call.task.empty()) throw UsageError("--task: IDs say already which demonstrations");
    ids = call.ids;
  }
  if (ids.empty()) {
    throw UsageError(call.task.empty() ? "--data: " + context.data.string() + " holds no demonstration"
                                       : "--task: no demonstration of " + call.task);
  }
  return ids;
}

int export_chosen(const ExportCall& call, const Context& context) {
  call.place.require_one();
  const DemoStore store = open_store(context);
  const std::vector<std::string> ids = chosen_ids(call, store, context);
  ExportPlan plan;
  plan.format = call.place.format();
  plan.target = call.place.path();
  plan.every_frame = call.pictures.empty() ? plan.format == ExchangeFormat::rlbench : call.pictures == "all";
  plan.all_variations = call.all_variations;
  plan.scenes = call.scenes;
  if (plan.every_frame && plan.format == ExchangeFormat::npz) {
    throw UsageError("--pictures all: an NPZ file holds the pictures of the keyframes");
  }
  if (plan.all_variations && plan.format != ExchangeFormat::rlbench) {
    throw UsageError("--all-variations: only RLBench's layout has folders of variations");
  }
  Progress progress("demonstration", static_cast<int>(ids.size()));
  try {
    export_demos(store, ids, plan, [&](int done, const std::string& which) { progress.report(done, which); });
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  if (context.json) {
    print_json({{"path", plan.target.string()}, {"demos", ids}});
  } else {
    std::printf("%zu exported to %s\n", ids.size(), plan.target.c_str());
  }
  return 0;
}

int import_all(const Place& place, const Context& context) {
  place.require_one();
  const FileLock lock = lock_data(context.data, "demos import");
  const DemoStore store(context.data);
  Imported imported;
  try {
    imported = import_demos(store, place.format(), place.path(), [](int, const std::string&) {});
  } catch (const BadImport& error) {
    throw UsageError(error.what());
  }
  if (context.json) {
    print_json({{"imported", imported.ids}, {"known", imported.known}});
  } else {
    for (const std::string& id : imported.ids) std::printf("%s\n", id.c_str());
    std::printf("%zu imported into %s", imported.ids.size(), context.data.c_str());
    if (imported.known > 0) std::printf("; %d skipped, they are there already", imported.known);
    std::printf("\n");
  }
  return 0;
}

}  // namespace

void add_demos_exchange(CLI::App& demos, Context& context) {
  CLI::App* out = add_demos_part(demos, context, "export", "Write demonstrations for other programs");
  auto call = std::make_shared<ExportCall>();
  add_place(*out, call->place);
  out->add_option("ids", call->ids, "Which ones; all when left out")->type_name("ID");
  out->add_option("--task", call->task, "All of this task")->type_name("NAME");
  out->add_option(
         "--pictures", call->pictures,
         "keyframes: those that were recorded (default of --hdf5 and --npz). all: of every frame, drawn "
         "again from its state (default of --rlbench, whose readers expect them)")
      ->check(CLI::IsMember({"keyframes", "all"}));
  out->add_flag("--all-variations", call->all_variations,
                "RLBench: one folder all_variations, as PerAct reads it, instead of one for each");
  add_demo_scene_options(*out, call->scenes);
  add_egl_option(*out, context);
  set_body(*out, context, [call, &context] { return export_chosen(*call, context); });

  CLI::App* in =
      add_demos_part(demos, context, "import",
                     "Read back what export wrote, all of it or nothing; what is here already is skipped");
  auto place = std::make_shared<Place>();
  add_place(*in, *place);
  set_body(*in, context, [place, &context] { return import_all(*place, context); });
}

}  // namespace flowscope::app
