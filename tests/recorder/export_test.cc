// Exports and their imports: what goes out comes back, and what is broken or foreign is refused with its
// place.
#include <gtest/gtest.h>

#include <fstream>

#include "recorder/formats/demo_arrays.h"
#include "recorder/formats/npz_demos.h"
#include "recorder/formats/rlbench_camera.h"
#include "recorder/formats/rlbench_episode.h"
#include "recorder/formats/robomimic_file.h"
#include "tests/support/same_demo.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;
using testing::expect_same_demo;
using testing::sample_demo;
using testing::stored;
using testing::TemporaryFolder;

Demo first_demo() { return stored(sample_demo()); }
Demo second_demo() {
  Demo demo = sample_demo();
  demo.info.task = "open_drawer";
  demo.frames.resize(15);
  demo.keyframes.pop_back();
  demo.keyframes.front().observation = testing::sample_observation(3);
  return stored(demo);
}

template <typename Call>
std::string problem_of(Call&& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

Bytes read_bytes(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_bytes(const fs::path& file, const Bytes& bytes) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void write_npz(const fs::path& file) {
  NpzDemoWriter writer(file);
  writer.add(first_demo());
  writer.add(second_demo());
  writer.finish();
}

void write_hdf5(const fs::path& file) {
  RobomimicWriter writer(file);
  writer.add(first_demo(), {});
  writer.add(second_demo(), {});
  writer.finish();
}

/// Reads all of a file; what went wrong, or nothing.
template <typename Reader>
std::string read_all(const fs::path& file) {
  return problem_of([&] {
    const Reader reader(file);
    for (int i = 0; i < reader.count(); ++i) encode_demo(reader.read(i));
  });
}

TEST(Export, NpzComesBackBitForBit) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "demos.npz";
  write_npz(file);
  const NpzDemoReader reader(file);
  ASSERT_EQ(reader.count(), 2);
  expect_same_demo(reader.read(0), first_demo());
  expect_same_demo(reader.read(1), second_demo());
}

TEST(Export, Hdf5ComesBackBitForBit) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "demos.hdf5";
  write_hdf5(file);
  const RobomimicReader reader(file);
  ASSERT_EQ(reader.count(), 2);
  expect_same_demo(reader.read(0), first_demo());
  expect_same_demo(reader.read(1), second_demo());
}

TEST(Export, MoreThanTenDemonstrationsKeepTheirOrder) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "demos.hdf5";
  RobomimicWriter writer(file);
  Demo demo = second_demo();
  for (int i = 0; i < 11; ++i) {
    demo.info.variation = i;
    writer.add(demo, {});
  }
  writer.finish();
  const RobomimicReader reader(file);
  ASSERT_EQ(reader.count(), 11);
  for (int i = 0; i < 11; ++i) EXPECT_EQ(reader.read(i).info.variation, i);
}

/// Stands in for the renderer: what is stored where it is, and something else between.
Observation pictures_of(const Demo& demo, int frame) {
  const Observation* own = stored_observation(demo, frame);
  Observation observation = own != nullptr ? *own : testing::sample_observation(frame);
  observation.views.push_back(testing::sample_view("overhead", frame, 16));
  return observation;
}

TEST(Export, RlbenchComesBackBitForBit) {
  const TemporaryFolder folder;
  for (const bool all_frames : {true, false}) {
    const fs::path root = folder.path() / (all_frames ? "all" : "keyframes");
    ExportSource source;
    if (all_frames) source.observe = pictures_of;
    const fs::path first = write_rlbench_episode(root, first_demo(), source, {all_frames, false});
    EXPECT_EQ(first, root / "push_buttons/variation3/episodes/episode0");
    EXPECT_EQ(write_rlbench_episode(root, first_demo(), source, {all_frames, false}).filename(), "episode1");
    write_rlbench_episode(root, second_demo(), source, {all_frames, true});
    const auto episodes = find_rlbench_episodes(root);
    ASSERT_EQ(episodes.size(), 3u);
    EXPECT_EQ(episodes[0], root / "open_drawer/all_variations/episodes/episode0");
    EXPECT_EQ(episodes[1], first);
    expect_same_demo(read_rlbench_episode(episodes[0]), second_demo());
    expect_same_demo(read_rlbench_episode(episodes[1]), first_demo());
    const auto pictures = std::distance(fs::directory_iterator(first / "front_depth"), {});
    EXPECT_EQ(pictures, all_frames ? 20 : 3);
    EXPECT_EQ(fs::exists(first / "overhead_rgb" / "19.png"), all_frames);
  }
}

TEST(Export, RlbenchWithoutARendererNeedsAPictureOfEveryFrame) {
  const TemporaryFolder folder;
  const std::string problem = problem_of([&] {
    write_rlbench_episode(folder.path(), first_demo(), {}, {true, false});
  });
  EXPECT_NE(problem.find("frame 1 has no picture"), std::string::npos) << problem;
  EXPECT_TRUE(fs::is_empty(folder.path())) << "half an episode was left behind";
}

TEST(RlbenchDepth, IsWithinAMicrometreAndKnowsWhereNothingWasHit) {
  CameraModel camera = CameraModel::from_vertical_fov("front", 64, 48, 0.7, {});
  camera.near_m = 0.01;
  camera.far_m = 4.5;
  DepthImage depth(64, 48);
  for (std::size_t i = 0; i < depth.data.size(); ++i)
    depth.data[i] = 0.01f + 4.49f * static_cast<float>(i) / (64 * 48 - 1);
  depth.data[5] = 0;
  const DepthImage back = unpack_rlbench_depth(pack_rlbench_depth(depth, camera), camera);
  for (std::size_t i = 0; i < depth.data.size(); ++i) EXPECT_NEAR(back.data[i], depth.data[i], 1e-6) << i;
  EXPECT_EQ(back.data[5], 0);
}

TEST(RlbenchCamera, ItsOwnFormulaGivesOurPoints) {
  const CameraModel camera = CameraModel::from_vertical_fov(
      "front", 128, 96, 0.7, {{1.35, 0.1, 1.58}, Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized()});
  const Eigen::Matrix3d inverse_k = rlbench_intrinsics(camera).inverse();
  const Eigen::Matrix4d world_from_camera = rlbench_extrinsics(camera);
  EXPECT_NEAR((world_from_camera.topLeftCorner<3, 3>().determinant()), 1, 1e-12);
  for (const auto& [u, v, z] : {std::tuple(0, 0, 1.0), std::tuple(127, 0, 2.0), std::tuple(3, 95, 0.4)}) {
    const Eigen::Vector3d in_camera = inverse_k * Eigen::Vector3d(u, v, 1) * z;
    const Eigen::Vector4d point = world_from_camera * in_camera.homogeneous();
    EXPECT_LT((point.head<3>() - camera.unproject(u + 0.5, v + 0.5, z)).norm(), 1e-12);
  }
}

TEST(Import, BrokenFilesAreRefusedAndNamed) {
  const TemporaryFolder folder;
  const fs::path npz = folder.path() / "demos.npz", hdf5 = folder.path() / "demos.hdf5",
                 broken = folder.path() / "b";
  write_npz(npz);
  write_hdf5(hdf5);
  for (const auto& [file, read] :
       {std::pair(npz, &read_all<NpzDemoReader>), std::pair(hdf5, &read_all<RobomimicReader>)}) {
    EXPECT_EQ(read(file), "");
    const Bytes whole = read_bytes(file);
    write_bytes(broken, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(whole.size() * 2 / 3)});
    EXPECT_NE(read(broken).find(broken.string()), std::string::npos) << "cut short: " << read(broken);
    write_bytes(broken, {'n', 'o', 'n', 'e'});
    EXPECT_NE(read(broken).find(broken.string()), std::string::npos) << "foreign: " << read(broken);
    EXPECT_NE(read(folder.path() / "missing").find("missing"), std::string::npos);
  }
}

TEST(Import, AnArrayOfAnotherShapeOrANameThatLeavesTheFolderIsRefused) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "demos.npz";
  const auto rewritten = [&](auto&& change) {
    NpzWriter writer(file);
    for (NamedArray array : arrays_of(first_demo(), ArrayParts::all)) {
      array.name = "demo_0/" + array.name;
      change(array);
      writer.add(array);
    }
    const std::int64_t count = 1;
    writer.add(make_array<std::int64_t>("demos", {1}, {&count, 1}));
    writer.finish();
    return read_all<NpzDemoReader>(file);
  };
  EXPECT_EQ(rewritten([](NamedArray&) {}), "");
  const std::string shape = rewritten([](NamedArray& array) {
    if (array.name == "demo_0/frame/q") array.spec.shape = {10, 14};
  });
  EXPECT_NE(shape.find("demo_0/frame/q has another type or shape"), std::string::npos) << shape;
  const std::string name = rewritten([](NamedArray& array) {
    if (array.name != "demo_0/header") return;
    std::string text(array.data.begin(), array.data.end());
    for (std::size_t i = 0; (i = text.find("\"wrist\"", i)) != std::string::npos;)
      text.replace(i, 7, "\"../xy\"");
    array = text_array(array.name, text);
  });
  EXPECT_NE(name.find("\"../xy\": not a plain name"), std::string::npos) << name;
  const std::string infinite = rewritten([](NamedArray& array) {
    if (array.name != "demo_0/frame/dq") return;
    const double inf = std::numeric_limits<double>::infinity();
    std::memcpy(array.data.data() + 8, &inf, 8);
  });
  EXPECT_NE(infinite.find("frame 0 is not a finite number"), std::string::npos) << infinite;
}

TEST(Import, EveryFlippedBitIsFoundOrHarmless) {
  const TemporaryFolder folder;
  const fs::path npz = folder.path() / "demos.npz", hdf5 = folder.path() / "demos.hdf5",
                 broken = folder.path() / "b";
  write_npz(npz);
  write_hdf5(hdf5);
  const Bytes first = encode_demo(first_demo()), second = encode_demo(second_demo());
  const auto check = [&]<typename Reader>(const fs::path& file, std::type_identity<Reader>) {
    const Bytes whole = read_bytes(file);
    for (std::size_t i = 0; i < 150; ++i) {
      Bytes damaged = whole;
      damaged[i * 7919 * 31 % whole.size()] ^= static_cast<std::uint8_t>(1u << i % 8);
      write_bytes(broken, damaged);
      problem_of([&] {
        const Reader reader(broken);
        ASSERT_LE(reader.count(), 2);
        for (int d = 0; d < reader.count(); ++d) {
          EXPECT_EQ(encode_demo(reader.read(d)), d == 0 ? first : second) << "flip " << i;
        }
      });
    }
  };
  check(npz, std::type_identity<NpzDemoReader>{});
  check(hdf5, std::type_identity<RobomimicReader>{});
}

TEST(Import, RlbenchNamesThePictureThatIsMissingOrOfAnotherSize) {
  const TemporaryFolder folder;
  const fs::path episode = write_rlbench_episode(folder.path(), first_demo(), {}, {false, false});
  const fs::path picture = episode / "left_shoulder_depth" / "1.png";
  fs::copy_file(picture, folder.path() / "kept.png");
  fs::remove(picture);
  std::string problem = problem_of([&] { read_rlbench_episode(episode); });
  EXPECT_NE(problem.find(picture.string()), std::string::npos) << problem;
  write_bytes(picture, {1, 2, 3});
  problem = problem_of([&] { read_rlbench_episode(episode); });
  EXPECT_NE(problem.find(picture.string()), std::string::npos) << problem;
  Bytes damaged = read_bytes(folder.path() / "kept.png");
  damaged[damaged.size() / 2] ^= 4;
  write_bytes(picture, damaged);
  problem = problem_of([&] { read_rlbench_episode(episode); });
  EXPECT_NE(problem.find(picture.string()), std::string::npos) << problem;
  fs::remove(episode / "flowscope.npz");
  problem = problem_of([&] { find_rlbench_episodes(folder.path()); });
  EXPECT_NE(problem.find("was not written by flowscope"), std::string::npos) << problem;
}

}  // namespace
}  // namespace flowscope
