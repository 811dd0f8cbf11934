// flowscope demos export and import, from the outside.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "recorder/demo_file.h"
#include "tests/support/run_command.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope::app {
namespace {

using nlohmann::json;
using testing::contains;
using testing::run_command;

class Exchange : public ::testing::Test {
 protected:
  void SetUp() override {
    Demo demo = testing::sample_demo();
    demo.info.created = "2026-11-22T10:00:00.000Z";
    ids_.push_back(store_.save(demo));
    demo = testing::sample_demo(1);
    demo.info.variation = 1;
    demo.info.created = "2026-11-22T10:00:01.000Z";
    ids_.push_back(store_.save(demo));
  }
  /// The files of another store, in order of creation.
  static std::vector<Bytes> files_of(const DemoStore& store) {
    std::vector<Bytes> files;
    for (const DemoInfo& info : store.list()) files.push_back(read_demo_bytes(store.path(info.id)));
    return files;
  }

  const testing::TemporaryFolder folder_, other_;
  const std::string data_ = folder_.path().string(), other_data_ = other_.path().string();
  const DemoStore store_{folder_.path()};
  std::vector<std::string> ids_;
};

TEST_F(Exchange, EveryFormatGivesTheSameFilesBack) {
  for (const std::string format : {"--npz", "--hdf5", "--rlbench"}) {
    const testing::TemporaryFolder back;
    const std::string target = other_data_ + "/" + format.substr(2);
    const auto out = run_command(
        {"demos", "export", format, target, "--pictures", "keyframes", "--data", data_, "--json"});
    ASSERT_EQ(out.code, 0) << out.err;
    EXPECT_EQ(json::parse(out.out)["demos"], json(ids_));
    const auto in =
        run_command({"demos", "import", format, target, "--data", back.path().string(), "--json"});
    ASSERT_EQ(in.code, 0) << in.err;
    EXPECT_EQ(json::parse(in.out)["imported"].size(), 2u);
    EXPECT_EQ(files_of(DemoStore(back.path())).size(), 2u);
    const std::vector<Bytes> before = files_of(store_);
    for (const Bytes& file : files_of(DemoStore(back.path()))) {
      EXPECT_NE(std::ranges::find(before, file), before.end()) << format << ": another file than before";
    }
  }
}

TEST_F(Exchange, OnlyWhatWasAskedFor) {
  const std::string target = other_data_ + "/one.npz";
  const auto out = run_command({"demos", "export", "--npz", target, ids_[1], "--data", data_, "--json"});
  ASSERT_EQ(out.code, 0) << out.err;
  EXPECT_EQ(json::parse(out.out)["demos"], json({ids_[1]}));
  EXPECT_EQ(run_command({"demos", "export", "--npz", target, "--task", "push_buttons", "--data", data_}).code,
            0);
}

TEST_F(Exchange, WrongCallsNameTheOptionAndWriteNothing) {
  const std::string target = other_data_ + "/x";
  const std::vector<std::pair<std::vector<std::string>, std::string>> calls = {
      {{"demos", "export"}, "--hdf5, --rlbench or --npz"},
      {{"demos", "export", "--npz", target, "--hdf5", target}, "one of them"},
      {{"demos", "export", "--npz", target, "nosuch"}, "nosuch"},
      {{"demos", "export", "--npz", target, "--task", "nosuch"}, "--task"},
      {{"demos", "export", "--npz", target, "--pictures", "all"}, "--pictures"},
      {{"demos", "export", "--npz", target, "--all-variations"}, "--all-variations"},
      // The sample's states fit no scene, so nobody can draw what lies between its keyframes.
      {{"demos", "export", "--hdf5", target, "--pictures", "all"}, ids_[0] + ": recorded in another version"},
      {{"demos", "import", "--npz", target}, target + ": there is no such file"},
      {{"demos", "import"}, "--hdf5, --rlbench or --npz"}};
  for (auto [call, problem] : calls) {
    call.insert(call.end(), {"--data", data_});
    const auto outcome = run_command(call);
    EXPECT_EQ(outcome.code, 2) << call[1] << " " << problem;
    EXPECT_TRUE(contains(outcome.err, problem)) << outcome.err;
  }
  EXPECT_TRUE(std::filesystem::is_empty(other_.path()));
  EXPECT_EQ(store_.list().size(), 2u);
}

TEST_F(Exchange, NothingIsImportedWhenTheSecondIsBroken) {
  const std::string root = other_data_ + "/rlbench";
  ASSERT_EQ(
      run_command({"demos", "export", "--rlbench", root, "--pictures", "keyframes", "--data", data_}).code,
      0);
  const std::filesystem::path picture =
      std::filesystem::path(root) / "push_buttons/variation3/episodes/episode0/wrist_rgb/2.png";
  ASSERT_TRUE(std::filesystem::exists(picture));
  std::ofstream(picture) << "none";
  const testing::TemporaryFolder back;
  const auto outcome = run_command({"demos", "import", "--rlbench", root, "--data", back.path().string()});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.err, picture.string())) << outcome.err;
  EXPECT_TRUE(DemoStore(back.path()).list().empty());
}

}  // namespace
}  // namespace flowscope::app
