#include "app/exchange.h"

#include "app/demo_contents.h"
#include "recorder/demo_check.h"
#include "recorder/demo_file.h"
#include "recorder/formats/npz_demos.h"
#include "recorder/formats/rlbench_episode.h"
#include "recorder/formats/robomimic_file.h"
#include "render/new_file.h"

namespace flowscope {
namespace {

/// The demonstrations that lie in a file or folder, one at a time.
struct Shelf {
  int count = 0;
  std::function<Demo(int)> read;
};

template <typename Reader>
Shelf shelf_of(const std::filesystem::path& file) {
  auto reader = std::make_shared<const Reader>(file);
  return {reader->count(), [reader](int i) { return reader->read(i); }};
}

Shelf open_shelf(ExchangeFormat format, const std::filesystem::path& source) {
  if (format == ExchangeFormat::hdf5) return shelf_of<RobomimicReader>(source);
  if (format == ExchangeFormat::npz) return shelf_of<NpzDemoReader>(source);
  const auto episodes = find_rlbench_episodes(source);
  return {static_cast<int>(episodes.size()),
          [episodes](int i) { return read_rlbench_episode(episodes[static_cast<std::size_t>(i)]); }};
}

/// Encoding checks what reading does not: that every number is finite.
void read_all(const Shelf& shelf) {
  for (int i = 0; i < shelf.count; ++i) encode_demo(shelf.read(i));
}

/// What a store would refuse is known before any of them is saved.
void judge_all(const Shelf& shelf) {
  for (int i = 0; i < shelf.count; ++i) {
    const Demo demo = decode_demo(encode_demo(shelf.read(i)), "demonstration", DemoParts::all);
    if (const std::string problem = find_incoherence(demo); !problem.empty())
      throw std::runtime_error("demonstration " + std::to_string(i) + ": " + problem);
  }
}

template <typename Add>
void for_each_demo(const DemoStore& store, const std::vector<std::string>& ids,
                   const ExchangeProgress& progress, Add&& add) {
  int done = 0;
  for (const std::string& id : ids) {
    try {
      const std::string left_out = add(store.load(id));
      progress(++done, left_out.empty() ? id : id + " (without its scene: " + left_out + ")");
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(id + ": " + error.what());
    }
  }
}

}  // namespace

void export_demos(const DemoStore& store, const std::vector<std::string>& ids, const ExportPlan& plan,
                  const ExchangeProgress& progress) {
  const bool rlbench = plan.format == ExchangeFormat::rlbench;
  ExportScenes scenes(plan.scenes, {plan.every_frame, rlbench});
  remove_stale_temporaries(rlbench ? plan.target : plan.target.parent_path());
  if (rlbench) {
    for_each_demo(store, ids, progress, [&](const Demo& demo) {
      write_rlbench_episode(plan.target, demo, scenes.source_for(demo),
                            {plan.every_frame, plan.all_variations});
      return scenes.left_out();
    });
    return;
  }
  const auto is_whole = [&](const std::filesystem::path& file) { read_all(open_shelf(plan.format, file)); };
  if (plan.format == ExchangeFormat::hdf5) {
    RobomimicWriter writer(plan.target);
    for_each_demo(store, ids, progress, [&](const Demo& demo) {
      writer.add(demo, scenes.source_for(demo));
      return scenes.left_out();
    });
    writer.finish(is_whole);
  } else {
    NpzDemoWriter writer(plan.target);
    for_each_demo(store, ids, progress, [&](const Demo& demo) {
      writer.add(demo);
      return std::string();
    });
    writer.finish(is_whole);
  }
}

Imported import_demos(const DemoStore& store, ExchangeFormat format, const std::filesystem::path& source,
                      const ExchangeProgress& progress) {
  Shelf shelf;
  try {
    shelf = open_shelf(format, source);
    if (shelf.count == 0) throw std::runtime_error(source.string() + ": holds no demonstration");
    judge_all(shelf);
  } catch (const std::exception& error) {
    const std::string what = error.what();
    throw BadImport(what.starts_with(source.string()) ? what : source.string() + ": " + what);
  }
  app::DemoContents contents(store);
  Imported imported;
  try {
    for (int i = 0; i < shelf.count; ++i) {
      const Demo demo = shelf.read(i);
      const Bytes file = encode_demo(demo);
      if (contents.has(file)) {
        ++imported.known;
        continue;
      }
      contents.add(file);
      try {
        imported.ids.push_back(store.save(demo));
        progress(i + 1, imported.ids.back());
      } catch (const RefusedDemo& error) {
        if (error.twin.empty()) throw;
        ++imported.known;
        progress(i + 1, std::string("left out: ") + error.what());
      }
    }
  } catch (...) {
    std::error_code ignored;  // nobody has seen them: not worth a place in the bin
    for (const std::string& id : imported.ids) std::filesystem::remove(store.path(id), ignored);
    throw;
  }
  return imported;
}

}  // namespace flowscope
