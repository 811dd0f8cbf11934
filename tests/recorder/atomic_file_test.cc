#include "recorder/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "recorder/sha256.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

std::string read(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

int entries(const std::filesystem::path& folder) {
  return static_cast<int>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(AtomicFile, WritesAndReplacesLeavingNothingElse) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "file";
  write_file_atomically(path, bytes_of("one"));
  EXPECT_EQ(read(path), "one");
  write_file_atomically(path, bytes_of(""));
  EXPECT_EQ(read(path), "");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, ANewFileNeverReplaces) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "file";
  EXPECT_TRUE(write_new_file_atomically(path, bytes_of("one")));
  EXPECT_FALSE(write_new_file_atomically(path, bytes_of("two")));
  EXPECT_EQ(read(path), "one");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, AFailureNamesPathAndCauseAndKeepsTheOld) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "target";
  std::filesystem::create_directory(path);
  std::ofstream(path / "kept") << "kept";
  try {
    write_file_atomically(path, bytes_of("text"));
    FAIL() << "a folder was replaced";
  } catch (const std::system_error& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
    EXPECT_EQ(error.code(), std::errc::is_a_directory);
  }
  EXPECT_EQ(read(path / "kept"), "kept");
  EXPECT_EQ(entries(folder.path()), 1);  // no temporary stays
  EXPECT_THROW(write_file_atomically(path / "kept" / "such", bytes_of("text")), std::system_error);
  EXPECT_EQ(entries(path), 1);
}

TEST(AtomicFile, AWriteCutShortLeavesTheOldFileWhole) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "file";
  write_file_atomically(path, bytes_of("old"));
  // A limit on file size fails the write in the middle, as a full disk does.
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto signal_before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(write_file_atomically(path, std::vector<std::uint8_t>(5000, 1)), std::system_error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, signal_before);
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, OnlyStaleTemporariesGo) {
  const testing::TemporaryFolder folder;
  const auto stale = folder.path() / ".flowscope-tmp-1-2", fresh = folder.path() / ".flowscope-tmp-3-4";
  const auto other = folder.path() / ".hidden";
  for (const auto& path : {stale, fresh, other}) std::ofstream(path) << "x";
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(2);
  std::filesystem::last_write_time(stale, old);
  std::filesystem::last_write_time(other, old);
  remove_stale_temporaries(folder.path());
  EXPECT_FALSE(std::filesystem::exists(stale));
  EXPECT_TRUE(std::filesystem::exists(fresh));
  EXPECT_TRUE(std::filesystem::exists(other));
  remove_stale_temporaries(folder.path() / "missing");
}

TEST(Sha256, MatchesThePublishedVectors) {
  EXPECT_EQ(sha256_hex(bytes_of("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

}  // namespace
}  // namespace flowscope
