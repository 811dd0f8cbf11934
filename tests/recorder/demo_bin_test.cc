#include "recorder/demo_bin.h"

#include <gtest/gtest.h>

#include <fstream>

#include "recorder/demo_file.h"
#include "recorder/demo_store.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

class Bin : public ::testing::Test {
 protected:
  std::string saved(std::uint64_t seed) const {
    Demo demo = testing::sample_demo(static_cast<double>(seed));
    demo.info.seed = seed;
    return store_.save(demo);
  }
  const testing::TemporaryFolder folder_;
  const DemoStore store_{folder_.path()};
};

TEST_F(Bin, WhatIsRemovedLiesThereAndComesBackByteForByte) {
  const std::string id = saved(1);
  const Bytes before = read_demo_bytes(store_.path(id));
  store_.remove(id);
  EXPECT_TRUE(store_.list().empty());
  const auto entries = store_.bin().list();
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0].info.id, id);
  EXPECT_EQ(entries[0].name, id + ".1");
  EXPECT_EQ(entries[0].info.frames, 20);
  EXPECT_EQ(entries[0].removed.size(), 20u);
  EXPECT_EQ(store_.restore(id), id);
  EXPECT_EQ(read_demo_bytes(store_.path(id)), before);
  EXPECT_TRUE(store_.bin().list().empty());
}

TEST_F(Bin, WhatWasReplacedAndItsReplacementChangePlaces) {
  const std::string id = saved(1);
  Demo newer = store_.load(id);
  newer.info.seed = 2;
  store_.replace(id, newer);
  EXPECT_EQ(store_.load(id).info.seed, 2u);
  ASSERT_EQ(store_.bin().list().size(), 1u);
  store_.restore(id);
  EXPECT_EQ(store_.load(id).info.seed, 1u);
  ASSERT_EQ(store_.bin().list().size(), 1u);
  EXPECT_EQ(store_.bin().list()[0].info.seed, 2u) << "the replacement is not lost either";
}

TEST_F(Bin, SeveralOfOneIdKeepApartAndEachCanBeNamed) {
  const std::string id = saved(1);
  for (std::uint64_t seed : {2, 3}) {
    Demo newer = store_.load(id);
    newer.info.seed = seed;
    store_.replace(id, newer);
  }
  store_.remove(id);
  ASSERT_EQ(store_.bin().list().size(), 3u);
  store_.restore(id + ".1");
  EXPECT_EQ(store_.load(id).info.seed, 1u);
  store_.restore(id);
  EXPECT_EQ(store_.load(id).info.seed, 3u) << "the one that was removed last";
  store_.restore(id);
  EXPECT_EQ(store_.load(id).info.seed, 1u) << "what had to give way to it";
}

TEST_F(Bin, UnknownIdsAreOutOfRangeAndForeignFilesStay) {
  EXPECT_THROW(store_.restore("nothing"), std::out_of_range);
  store_.remove(saved(1));
  const auto foreign = folder_.path() / "bin" / "notes.txt";
  std::ofstream(foreign) << "x";
  store_.bin().empty();
  EXPECT_TRUE(store_.bin().list().empty());
  EXPECT_TRUE(std::filesystem::exists(foreign));
  EXPECT_THROW(store_.restore("nothing"), std::out_of_range);
}

TEST_F(Bin, ADamagedFileIsListedByItsNameAndCanBeRemoved) {
  const std::string id = saved(1);
  std::ofstream(store_.path(id)) << "no demonstration";
  store_.remove(id);
  const auto entries = store_.bin().list();
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0].info.id, id);
  EXPECT_EQ(entries[0].info.bytes, 16u);
}

TEST_F(Bin, AnAdoptedFileIsTheSameAndGivesWayToATakenId) {
  const std::string id = saved(1);
  const auto bytes_of = [](double motion) { return encode_demo(testing::sample_demo(motion)); };
  const Bytes bytes = bytes_of(2);
  const std::string other = store_.adopt(bytes, id);
  EXPECT_NE(other, id);
  EXPECT_EQ(read_demo_bytes(store_.path(other)), bytes);
  EXPECT_EQ(store_.adopt(bytes_of(3), std::string(64, 'x')).size(), 64u);
  EXPECT_EQ(store_.adopt(bytes_of(4), std::string(64, 'x')).size(), 64u);
  EXPECT_THROW(store_.adopt(Bytes(100, 7), "bad"), BadDemo);
  EXPECT_FALSE(std::filesystem::exists(store_.path("bad")));
}

}  // namespace
}  // namespace flowscope
