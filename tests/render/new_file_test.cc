// What may be written where, and what is left when it fails.
#include "render/new_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <string>
#include <system_error>

#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

std::string read(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(NewFile, MakesFoldersAndTakesThemAwayAgainUnlessItCommits) {
  const testing::TemporaryFolder folder;
  const fs::path file = folder.path() / "a/b/file";
  {
    NewFile never(file);
    never.write(bytes_of("x"));
    EXPECT_TRUE(fs::exists(never.temporary()));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
  NewFile whole(file);
  whole.write(bytes_of("one "));
  whole.write(bytes_of("two"));
  whole.commit();
  EXPECT_EQ(read(file), "one two");
}

TEST(NewFile, ADeviceOrAPipeOfThatNameStays) {
  const testing::TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(NewFile{pipe}, std::runtime_error);
  EXPECT_THROW(NewFile{"/dev/null"}, std::runtime_error);
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_THROW(NewFile{folder.path() / ""}, std::invalid_argument);
}

TEST(NewFile, AFailedCheckNamesTheTargetAndKeepsWhatWasThere) {
  const testing::TemporaryFolder folder;
  const fs::path path = folder.path() / "film.mp4";
  std::ofstream(path) << "old";
  {
    NewFile file(path);
    file.write(bytes_of("torn"));
    try {
      file.check([](const fs::path& place) { throw std::runtime_error(place.string() + ": is torn"); });
      FAIL() << "nothing was said";
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()), "cannot write " + path.string() + ": film.mp4: is torn");
      EXPECT_FALSE(is_full_disk(error));
    }
  }
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(NewFile, AProgramThatIsKilledLeavesWhatIsSweptLater) {
  const testing::TemporaryFolder folder;
  const fs::path file = temporary_name(folder.path()), full = temporary_name(folder.path());
  std::ofstream(file) << "x";
  fs::create_directories(full / "rgb");
  std::ofstream(full / "rgb" / "0.png") << "x";
  std::ofstream(folder.path() / "kept") << "x";
  remove_stale_temporaries(folder.path());
  EXPECT_TRUE(fs::exists(file)) << "it may be at work";
  for (const auto& path : {file, full})
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(2));
  remove_stale_temporaries(folder.path());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(NewFile, KnowsAFullDiskByItsErrorOnly) {
  for (const int error : {ENOSPC, EDQUOT, EFBIG}) {
    EXPECT_TRUE(is_full_disk(std::system_error(error, std::generic_category())));
    EXPECT_TRUE(is_full_disk(fs::filesystem_error("x", std::error_code(error, std::system_category()))));
  }
  EXPECT_FALSE(is_full_disk(std::system_error(EACCES, std::generic_category())));
  EXPECT_FALSE(is_full_disk(std::runtime_error("No space left on device")));
}

}  // namespace
}  // namespace flowscope
