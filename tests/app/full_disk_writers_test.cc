// Every writer of the program, on a disk with room for none, one byte, parts, and all but the last byte of
// its output: whole or an error that names the file, and nothing left behind.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>

#include "app/ablate_store.h"
#include "app/trace_store.h"
#include "recorder/atomic_file.h"
#include "recorder/demo_store.h"
#include "recorder/formats/npz_demos.h"
#include "recorder/formats/rlbench_episode.h"
#include "recorder/formats/robomimic_file.h"
#include "recorder/mesh/mesh_object.h"
#include "render/cloud.h"
#include "render/depth_png.h"
#include "render/encode.h"
#include "tests/support/fake_values.h"
#include "tests/support/sample_demo.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/small_disk.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;
using testing::FileSizeLimit;
using testing::sample_demo;
using testing::SmallDisk;

struct Writer {
  const char* target;  ///< a file, or a folder where it writes several
  std::function<void(const fs::path&)> write;
};

/// No two pixels alike, so that nothing packs it small.
ImageRgb noise(int seed) {
  ImageRgb image(96, 64);
  std::uint32_t state = 12345 + static_cast<std::uint32_t>(seed);
  for (auto& byte : image.data)
    byte = static_cast<std::uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  return image;
}

DepthImage slope() {
  DepthImage depth(96, 64);
  for (std::size_t i = 0; i < depth.data.size(); ++i)
    depth.data[i] = 0.001f * static_cast<float>(i * i % 7919);
  return depth;
}

PointCloud cloud() {
  PointCloud points;
  for (int i = 0; i < 2000; ++i) {
    points.position.push_back(Eigen::Vector3f(0.1f, 0.2f, 0.3f) * static_cast<float>(i));
    points.color.push_back({0.5f, 0.25f, static_cast<float>(i % 256) / 255});
    points.view.push_back(0);
    points.pixel.push_back(i);
  }
  return points;
}

void film(const fs::path& file) {
  Mp4Writer writer(file, 96, 64, 20);
  for (int i = 0; i < 12; ++i) writer.add(noise(i));
  writer.finish();
}

template <typename DemoWriter, typename... Source>
void demos(const fs::path& file, Source... source) {
  DemoWriter writer(file);
  for (int i = 0; i < 2; ++i) writer.add(sample_demo(), source...);
  writer.finish();
}

void ablation(const fs::path& folder) {
  AblationStore store(folder, {.tasks = {"push_buttons"}, .demonstrations = "abc", .steps = 10});
  AblationRun run;
  run.policy = "full-0.flow";
  for (int seed = 0; seed < 20; ++seed) {
    run.seed = seed;
    store.put(run);
  }
}

const std::vector<Writer>& writers() {
  static const std::vector<Writer> all{
      {"bytes.bin",
       [](const fs::path& p) { write_file_atomically(p, std::vector<std::uint8_t>(50'000, 7)); }},
      {"picture.png", [](const fs::path& p) { write_png(p, noise(0)); }},
      {"depth.png", [](const fs::path& p) { write_depth_png(p, slope()); }},
      {"cloud.ply", [](const fs::path& p) { write_cloud(p, cloud()); }},
      {"cloud.pcd", [](const fs::path& p) { write_cloud(p, cloud()); }},
      {"film.mp4", film},
      {"demos.npz", [](const fs::path& p) { demos<NpzDemoWriter>(p); }},
      {"demos.hdf5", [](const fs::path& p) { demos<RobomimicWriter>(p, ExportSource{}); }},
      {"rlbench",
       [](const fs::path& p) {
         write_rlbench_episode(p, sample_demo(), {}, {false, false});
       }},
      {"object", [](const fs::path& p) { write_object(testing::sphere(0.05, 12, 24), {.name = "ball"}, p); }},
      {"trace.json", [](const fs::path& p) { write_trace_file(p, {testing::fake_trace("t", 8, 1)}); }},
      {"ablation", ablation}};
  return all;
}

/// Files below a folder with their sizes; folders too, with 0.
std::map<std::string, std::uint64_t> tree(const fs::path& folder) {
  std::map<std::string, std::uint64_t> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    found[fs::relative(entry.path(), folder).string()] = entry.is_regular_file() ? entry.file_size() : 0;
  }
  return found;
}

/// Without its mend a writer says nothing, or leaves things behind.
void expect_refusal(const Writer& writer, const fs::path& folder) {
  try {
    writer.write(folder / writer.target);
    ADD_FAILURE() << "nothing was said";
  } catch (const std::exception& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("cannot write"), std::string::npos) << what;
    EXPECT_NE(what.find((folder / writer.target).string()), std::string::npos) << what;
    EXPECT_EQ(what.find(".flowscope-tmp"), std::string::npos) << what;
    EXPECT_TRUE(is_full_disk(error)) << what;
  }
  const auto left = tree(folder);
  EXPECT_TRUE(left.empty() || std::string(writer.target) == "ablation") << left.begin()->first;
  for (const auto& [name, bytes] : left) EXPECT_EQ(name.find(".flowscope-tmp"), std::string::npos) << name;
}

class FullDiskWriters : public ::testing::TestWithParam<Writer> {};

TEST_P(FullDiskWriters, WholeOrAClearErrorAndNothingLeft) {
  const testing::TemporaryFolder whole, folder;
  GetParam().write(whole.path() / GetParam().target);
  std::uint64_t largest = 0;
  for (const auto& [name, bytes] : tree(whole.path())) largest = std::max(largest, bytes);
  ASSERT_GT(largest, 1000u);
  for (std::uint64_t room : {std::uint64_t{0}, std::uint64_t{1}, largest / 8, largest / 4, 3 * largest / 8,
                             largest / 2, 3 * largest / 4, 7 * largest / 8, largest - 1}) {
    SCOPED_TRACE("room for " + std::to_string(room) + " of " + std::to_string(largest) + " bytes in a file");
    const testing::TemporaryFolder place;
    const FileSizeLimit limit(room);
    expect_refusal(GetParam(), place.path());
  }
  GetParam().write(folder.path() / GetParam().target);
  EXPECT_EQ(tree(folder.path()), tree(whole.path())) << "the process goes on as before";
}

TEST_P(FullDiskWriters, ARealDiskOfAFewPages) {
  const testing::TemporaryFolder whole;
  GetParam().write(whole.path() / GetParam().target);
  std::uint64_t pages = 0;
  for (const auto& [name, bytes] : tree(whole.path()))
    pages += (bytes + SmallDisk::page - 1) / SmallDisk::page;
  SmallDisk disk(whole.path() / "disk");
  if (!disk.why_not().empty()) GTEST_SKIP() << disk.why_not();
  for (const std::uint64_t room : {std::uint64_t{0}, pages / 2, pages - 1}) {
    SCOPED_TRACE("room for " + std::to_string(room) + " of " + std::to_string(pages) + " pages");
    disk.leave(room);
    const fs::path place = whole.path() / "disk" / "out";
    fs::create_directory(place);
    expect_refusal(GetParam(), place);
    fs::remove_all(place);
  }
  disk.leave(4 * pages + 16);
  GetParam().write(whole.path() / "disk" / GetParam().target);
}

INSTANTIATE_TEST_SUITE_P(All, FullDiskWriters, ::testing::ValuesIn(writers()), [](const auto& row) {
  std::string name = row.param.target;
  std::ranges::replace(name, '.', '_');
  return name;
});

TEST(FullDisk, ReplacingADemonstrationLeavesItAndNoCopyInTheBin) {
  const testing::TemporaryFolder folder;
  const DemoStore store(folder.path());
  const std::string id = store.save(sample_demo());
  const auto before = tree(folder.path());
  {
    const FileSizeLimit limit(1000);
    EXPECT_THROW(store.replace(id, sample_demo()), std::system_error);
  }
  EXPECT_EQ(tree(folder.path()), before);
}

}  // namespace
}  // namespace flowscope
