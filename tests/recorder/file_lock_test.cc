#include "recorder/file_lock.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <optional>

#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

const testing::TemporaryFolder& folder() {
  static const testing::TemporaryFolder made;
  return made;
}

std::string refusal_of(const std::filesystem::path& path) {
  try {
    FileLock(path, "the data", "second");
  } catch (const LockedByOther& error) {
    return error.what();
  }
  return "";
}

TEST(FileLock, TheSecondIsToldWhoTheFirstIs) {
  const auto path = folder().path() / "lock";
  {
    const FileLock first(path, "the data", "flowscope record close_jar");
    const std::string refusal = refusal_of(path);
    EXPECT_TRUE(refusal.starts_with("the data is in use by flowscope record close_jar (process " +
                                    std::to_string(::getpid()) + ", since 20"))
        << refusal;
    EXPECT_NE(refusal_of(path), "") << "being refused takes nothing from the first";
  }
  EXPECT_EQ(refusal_of(path), "");
  EXPECT_FALSE(std::filesystem::exists(path)) << "nothing stays behind";
}

TEST(FileLock, MovingKeepsIt) {
  const auto path = folder().path() / "moved";
  std::optional<FileLock> first(std::in_place, path, "the data", "first");
  const FileLock second(std::move(*first));
  first.reset();
  EXPECT_NE(refusal_of(path), "");
}

TEST(FileLock, WhatAKilledProgramLeftIsNoObstacle) {
  const auto path = folder().path() / "killed";
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const FileLock lock(path, "the data", "child");
    if (::write(ready[1], "x", 1) == 1) ::pause();
    ::_exit(1);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_NE(refusal_of(path).find("child (process " + std::to_string(child)), std::string::npos);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_TRUE(std::filesystem::exists(path));
  EXPECT_EQ(refusal_of(path), "");
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(FileLock, AFileThatCannotBeMadeIsNamed) {
  try {
    FileLock(folder().path() / "no" / "lock", "the data", "x");
    FAIL() << "a lock in no folder";
  } catch (const std::system_error& error) {
    EXPECT_NE(std::string(error.what()).find("no/lock"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace flowscope
