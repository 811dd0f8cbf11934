#include "recorder/demo_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <thread>

#include "recorder/demo_file.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::sample_demo;
using testing::TemporaryFolder;

void expect_same_but_depth(const Observation& a, const Observation& b) {
  ASSERT_EQ(a.views.size(), b.views.size());
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    EXPECT_EQ(a.views[i].camera, b.views[i].camera);
    EXPECT_EQ(a.views[i].rgb, b.views[i].rgb);
    ASSERT_EQ(a.views[i].depth.data.size(), b.views[i].depth.data.size());
    for (std::size_t p = 0; p < a.views[i].depth.data.size(); ++p) {
      EXPECT_NEAR(a.views[i].depth.data[p], b.views[i].depth.data[p], 0.0000502);
    }
  }
}

void write(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

std::string problem_of(const Bytes& bytes) {
  try {
    decode_demo(bytes, "x.demo", DemoParts::all);
  } catch (const BadDemo& error) {
    return error.what();
  }
  return "";
}

TEST(DemoStore, WhatIsSavedComesBackExactly) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  const Demo demo = sample_demo();
  const std::string id = store.save(demo);
  const Demo loaded = store.load(id);
  EXPECT_EQ(loaded.info.id, id);
  EXPECT_EQ(loaded.info.task, demo.info.task);
  EXPECT_EQ(loaded.info.variation, demo.info.variation);
  EXPECT_EQ(loaded.info.seed, demo.info.seed);
  EXPECT_EQ(loaded.info.bytes, std::filesystem::file_size(store.path(id)));
  EXPECT_EQ(loaded.instructions, demo.instructions);
  EXPECT_EQ(loaded.simulator, demo.simulator);
  EXPECT_EQ(loaded.bounds, demo.bounds);
  ASSERT_EQ(loaded.frames.size(), demo.frames.size());
  for (std::size_t i = 0; i < demo.frames.size(); ++i) {
    EXPECT_EQ(loaded.frames[i].time_s, demo.frames[i].time_s);
    EXPECT_EQ(loaded.frames[i].q, demo.frames[i].q);
    EXPECT_EQ(loaded.frames[i].dq, demo.frames[i].dq);
    EXPECT_EQ(loaded.frames[i].openness, demo.frames[i].openness);
    EXPECT_EQ(loaded.frames[i].gripper_open, demo.frames[i].gripper_open);
    EXPECT_EQ(loaded.frames[i].world_from_tool, demo.frames[i].world_from_tool);
    EXPECT_EQ(loaded.frames[i].state, demo.frames[i].state) << "frame " << i;
  }
  expect_same_but_depth(loaded.start, demo.start);
  ASSERT_EQ(loaded.keyframes.size(), demo.keyframes.size());
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    EXPECT_EQ(loaded.keyframes[k].frame, demo.keyframes[k].frame);
    EXPECT_EQ(loaded.keyframes[k].action, demo.keyframes[k].action);
    expect_same_but_depth(loaded.keyframes[k].observation, demo.keyframes[k].observation);
  }
}

TEST(DemoStore, NoHitStaysNoHitAndFarViewsKeepTheirRange) {
  Demo demo = sample_demo();
  demo.start.views[0].depth.data[5] = 60.0f;
  const Demo loaded = decode_demo(encode_demo(demo), "x.demo", DemoParts::all);
  EXPECT_EQ(loaded.start.views[0].depth.data[0], 0.0f);
  EXPECT_NEAR(loaded.start.views[0].depth.data[5], 60.0f, 1e-3);
}

TEST(DemoStore, KeyframesComeWithoutStates) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  const std::string id = store.save(sample_demo());
  const Demo loaded = store.load_keyframes(id);
  EXPECT_EQ(loaded.keyframes.size(), 2u);
  EXPECT_EQ(loaded.frames.size(), 20u);
  EXPECT_TRUE(loaded.frames[3].state.qpos.empty());
  expect_same_but_depth(loaded.keyframes[1].observation, sample_demo().keyframes[1].observation);
}

TEST(DemoStore, ListReadsHeadersInOrderOfCreation) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  Demo demo = sample_demo();
  demo.info.created = "2026-11-22T10:00:02.000Z";
  const std::string later = store.save(demo);
  demo = sample_demo(1);
  demo.info.created = "2026-11-22T10:00:01.000Z";
  const std::string earlier = store.save(demo);
  const std::vector<DemoInfo> infos = store.list();
  ASSERT_EQ(infos.size(), 2u);
  EXPECT_EQ(infos[0].id, earlier);
  EXPECT_EQ(infos[1].id, later);
  EXPECT_EQ(infos[0].frames, 20);
  EXPECT_EQ(infos[0].keyframes, 2);
  EXPECT_EQ(infos[0].instruction, demo.info.instruction);
  EXPECT_EQ(infos[0].seed, demo.info.seed);
}

TEST(DemoStore, TwoWritersNeverShareAnId) {
  const TemporaryFolder folder;
  std::array<std::vector<std::string>, 2> ids;
  std::vector<std::jthread> threads;
  for (int writer = 0; writer < 2; ++writer) {
    threads.emplace_back([&, writer] {
      const DemoStore store(folder.path());
      for (int i = 0; i < 10; ++i) ids[writer].push_back(store.save(sample_demo(10 * writer + i)));
    });
  }
  threads.clear();
  std::set<std::string> all(ids[0].begin(), ids[0].end());
  all.insert(ids[1].begin(), ids[1].end());
  EXPECT_EQ(all.size(), 20u);
  EXPECT_EQ(DemoStore(folder.path()).list().size(), 20u);
}

TEST(DemoStore, AnyFlippedByteIsFound) {
  const Bytes good = encode_demo(sample_demo());
  EXPECT_EQ(problem_of(good), "");
  for (std::size_t at = 0; at < good.size(); at += 211) {
    Bytes bad = good;
    bad[at] ^= 0x40;
    EXPECT_NE(problem_of(bad), "") << "byte " << at << " of " << good.size();
  }
}

TEST(DemoStore, AnyCutIsFound) {
  const Bytes good = encode_demo(sample_demo());
  for (std::size_t size = 0; size < good.size(); size += 307) {
    EXPECT_NE(problem_of(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size))), "") << size;
  }
}

TEST(DemoStore, ComplaintsNameFileAndPlace) {
  EXPECT_EQ(problem_of(Bytes(100, 'x')), "x.demo: does not begin with FLOWDEMO: not a demonstration");
  EXPECT_EQ(problem_of({}), "x.demo: too short to be a demonstration");
  Bytes newer = encode_demo(sample_demo());
  newer[8] = 2;
  EXPECT_EQ(problem_of(newer), "x.demo: has format version 2; this program reads 1");
  Bytes bad = encode_demo(sample_demo());
  bad[bad.size() / 2] ^= 1;
  EXPECT_EQ(problem_of(bad), "x.demo: checksum does not match: cut short or damaged");
}

Demo blank_demo() {
  Demo demo = sample_demo();
  auto& pixels = demo.keyframes[0].observation.views[2].rgb.data;
  std::fill(pixels.begin(), pixels.end(), std::uint8_t{40});
  return demo;
}

TEST(DemoStore, WhatCheckWouldCallBadIsNotTakenIn) {
  const TemporaryFolder folder, source;
  const DemoStore store(folder.path());
  const std::string id = store.save(sample_demo());
  Demo standing = sample_demo(1), silent = sample_demo(2), wordless = sample_demo(3), marked = sample_demo(4);
  standing.frames.resize(1);
  standing.keyframes.clear();
  silent.info.instruction.clear();
  silent.instructions.clear();
  wordless.instructions = {wordless.info.instruction = " … !"};
  while (marked.keyframes.size() <= 1000) marked.keyframes.push_back(marked.keyframes.back());
  const std::vector<std::pair<Demo, std::string>> bad{{standing, "fewer than two frames"},
                                                      {blank_demo(), "the picture has one colour"},
                                                      {silent, "no instruction"},
                                                      {wordless, "the instruction holds no word"},
                                                      {marked, "has more than 1000 entries"},
                                                      {sample_demo(), "holds the same states as " + id}};
  for (const auto& [demo, problem] : bad) {
    const auto refused = [&, &wanted = problem](const std::function<void()>& take) {
      try {
        take();
        ADD_FAILURE() << "taken in: " << wanted;
      } catch (const RefusedDemo& error) {
        EXPECT_NE(std::string(error.what()).find(wanted), std::string::npos) << error.what();
        EXPECT_EQ(error.twin, wanted.starts_with("holds") ? id : "");
      } catch (const BadDemo& error) {  // adopt(): what cannot even be read
        EXPECT_NE(std::string(error.what()).find(wanted), std::string::npos) << error.what();
      }
    };
    refused([&, &one = demo] { store.save(one); });
    refused([&, &one = demo] { store.adopt(encode_demo(one), "other"); });
    if (!problem.starts_with("holds")) refused([&, &one = demo] { store.replace(id, one); });
  }
  store.replace(id, store.load(id));  // in its own place it is no twin
  EXPECT_TRUE(store.check().empty());
  EXPECT_EQ(store.list().size(), 1u);
}

TEST(DemoStore, OfWritersOfOneMotionOneSaves) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  std::atomic<int> saved{0}, refused{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      try {
        store.save(sample_demo());
        ++saved;
      } catch (const RefusedDemo&) {
        ++refused;
      }
    });
  }
  threads.clear();
  EXPECT_EQ(saved, 1);
  EXPECT_EQ(refused, 3);
}

TEST(DemoStore, TheSameMotionInAnotherSceneIsAnotherDemonstration) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  store.save(sample_demo());
  Demo elsewhere = sample_demo();
  elsewhere.info.task = "other_scene";
  EXPECT_NO_THROW(store.save(elsewhere));
  EXPECT_TRUE(store.check().empty());
}

TEST(DemoStore, CheckNamesTheDamagedAndTheIncoherent) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  store.save(sample_demo());
  // Past the store, which would not take them.
  const std::string blank = "blank", disordered = "disordered";
  write(store.path(blank), encode_demo(blank_demo()));
  Demo disorder = sample_demo();
  std::swap(disorder.keyframes[0], disorder.keyframes[1]);
  write(store.path(disordered), encode_demo(disorder));
  const std::string damaged = "whole-before";
  write(store.path(damaged), encode_demo(sample_demo(1)));
  Bytes bytes = read_demo_bytes(store.path(damaged));
  bytes[bytes.size() - 100] ^= 1;
  write(store.path(damaged), bytes);

  int checked = 0;
  const std::vector<DemoProblem> problems = store.check(&checked);
  EXPECT_EQ(checked, 4);
  ASSERT_EQ(problems.size(), 3u);
  EXPECT_EQ(problems[0].id, blank);
  EXPECT_NE(problems[0].problem.find("keyframe 0, view right_shoulder: the picture has one colour"),
            std::string::npos)
      << problems[0].problem;
  EXPECT_EQ(problems[1].id, disordered);
  EXPECT_NE(problems[1].problem.find("out of order"), std::string::npos) << problems[1].problem;
  EXPECT_EQ(problems[2].id, damaged);
  EXPECT_NE(problems[2].problem.find("checksum"), std::string::npos) << problems[2].problem;
  EXPECT_THROW(store.load(damaged), BadDemo);
}

TEST(DemoStore, WhatHasNoReadableHeaderIsToldBesideTheList) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  store.save(sample_demo());
  write(store.path("torn"), {'F', 'L', 'O', 'W', 'D', 'E', 'M', 'O'});
  std::vector<DemoProblem> unreadable;
  EXPECT_EQ(store.list(&unreadable).size(), 1u);
  ASSERT_EQ(unreadable.size(), 1u);
  EXPECT_EQ(unreadable[0].id, "torn");
  EXPECT_NE(unreadable[0].problem.find("torn.demo: too short"), std::string::npos) << unreadable[0].problem;
}

TEST(DemoStore, WhatTheFormatCannotHoldIsRefusedAndLeavesNothing) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Demo demo = sample_demo();
  demo.frames[7].dq[2] = nan;
  EXPECT_THROW(store.save(demo), std::invalid_argument);
  demo = sample_demo();
  demo.frames[7].state.qpos[0] = nan;
  EXPECT_THROW(store.save(demo), std::invalid_argument);
  demo = sample_demo();
  demo.frames[7].state.qpos.push_back(0);
  EXPECT_THROW(store.save(demo), std::invalid_argument);
  demo = sample_demo();
  demo.start.views[0].rgb.data.pop_back();
  EXPECT_THROW(store.save(demo), std::invalid_argument);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "demos"));
}

TEST(DemoStore, UnknownIdsAndPathsAreOutOfRange) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  EXPECT_THROW(store.load("20261122-101530-nothing-0001"), std::out_of_range);
  EXPECT_THROW(store.load("../../etc/passwd"), std::out_of_range);
  EXPECT_THROW(store.load(""), std::out_of_range);
  EXPECT_THROW(store.remove("nothing"), std::out_of_range);
}

TEST(DemoStore, RemovedIsGoneAndForeignFilesAreLeftAlone) {
  const TemporaryFolder folder;
  const DemoStore store(folder.path());
  const std::string id = store.save(sample_demo());
  write(folder.path() / "demos" / "notes.txt", {'x'});
  write(folder.path() / "demos" / ".flowscope-tmp-1-1", {'x'});
  EXPECT_EQ(store.list().size(), 1u);
  store.remove(id);
  EXPECT_TRUE(store.list().empty());
  EXPECT_TRUE(store.check().empty());
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "demos" / "notes.txt"));
}

}  // namespace
}  // namespace flowscope
