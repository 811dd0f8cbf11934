// A thousand bit flips and cuts: each is found, none brings the reader down, and what is whole stays
// readable beside them.
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <set>

#include "recorder/demo_file.h"
#include "recorder/demo_store.h"
#include "recorder/sha256.h"
#include "tests/support/sample_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::sample_demo;

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t end) {
  return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
}

Bytes damaged(Bytes bytes, Random& random) {
  if (below(random, 2) == 0) {
    bytes.resize(below(random, bytes.size()));
  } else {
    bytes[below(random, bytes.size())] ^= static_cast<std::uint8_t>(1u << below(random, 8));
  }
  return bytes;
}

void write(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

TEST(DemoDamage, AThousandFlipsAndCutsAreAllFound) {
  const testing::TemporaryFolder folder;
  const DemoStore store(folder.path());
  const std::string good = store.save(sample_demo());
  const Bytes bytes = read_demo_bytes(store.path(good));
  Random random(4);
  std::set<std::string> expected;
  for (int i = 0; i < 1000; ++i) {
    const std::string id = "damaged-" + std::to_string(i);
    write(store.path(id), damaged(bytes, random));
    expected.insert(id);
    EXPECT_THROW(store.load(id), BadDemo) << id;
    EXPECT_THROW(store.load_keyframes(id), BadDemo) << id;
  }
  int checked = 0;
  std::set<std::string> found;
  for (const DemoProblem& problem : store.check(&checked)) found.insert(problem.id);
  EXPECT_EQ(checked, 1001);
  EXPECT_EQ(found, expected);
  EXPECT_EQ(store.load(good).frames.size(), 20u);
  EXPECT_FALSE(store.list().empty());
}

/// With a checksum that fits, as a program with an error or a malicious one would write it: what cannot be
/// used is refused, and never by a crash.
TEST(DemoDamage, FlipsUnderAFittingChecksumNeverCrash) {
  const Bytes bytes = encode_demo(sample_demo());
  constexpr std::size_t checksum_bytes = 64;
  Random random(5);
  int refused = 0;
  for (int i = 0; i < 1000; ++i) {
    Bytes bad(bytes.begin(), bytes.end() - checksum_bytes);
    // Every other one in the header, where the sizes are.
    const std::size_t end = i % 2 == 0 ? std::min<std::size_t>(3000, bad.size()) : bad.size();
    for (std::size_t flips = 1 + below(random, 3); flips > 0; --flips) {
      bad[below(random, end)] ^= static_cast<std::uint8_t>(1u << below(random, 8));
    }
    const std::string checksum = sha256_hex(bad);
    bad.insert(bad.end(), checksum.begin(), checksum.end());
    try {
      decode_demo(bad, "x.demo", DemoParts::all);
    } catch (const BadDemo&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace flowscope
