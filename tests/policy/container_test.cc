#include "policy/container.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <random>

#include "policy/policy.h"
#include "recorder/sha256.h"

namespace flowscope {
namespace {

using Bytes = std::vector<std::uint8_t>;

class ContainerFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("flowscope_container_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    path_ = folder_ / "policy.flow";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static Container small() {
    torch::manual_seed(1);
    Container c;
    c.text = {{"config", R"({"d_model": 24, "name": "größe"})"}, {"step", "12"}};
    c.tensors = {{"weight", torch::randn({3, 4})},
                 {"steps", torch::arange(5, torch::kInt64)},
                 {"mask", torch::tensor({1, 0, 1}, torch::kUInt8)},
                 {"scalar", torch::tensor(2.5f)},
                 {"none", torch::empty({0, 7})}};
    return c;
  }

  Bytes bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  void put(const Bytes& content) const {
    std::ofstream file(path_, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
  }
  /// A file with this header and data and a checksum that is right.
  void put_sealed(const std::string& header, std::size_t data_bytes) const {
    Bytes content(8);
    const std::uint64_t length = header.size();
    std::memcpy(content.data(), &length, 8);
    content.insert(content.end(), header.begin(), header.end());
    content.resize(content.size() + data_bytes, 1);
    const std::string checksum = sha256_hex(content);
    content.insert(content.end(), checksum.begin(), checksum.end());
    put(content);
  }
  std::string complaint() const {
    try {
      read_container(path_);
    } catch (const BadCheckpoint& error) {
      return error.what();
    }
    return "";
  }
  void expect_complaint(const std::string& part) const {
    const std::string text = complaint();
    EXPECT_NE(text.find(part), std::string::npos) << "said: " << text;
    EXPECT_EQ(text.rfind(path_.string() + ": ", 0), 0u) << "does not begin with the file: " << text;
  }

  std::filesystem::path folder_, path_;
};

TEST_F(ContainerFile, ReturnsWhatWasWritten) {
  const Container written = small();
  write_container(path_, written);
  const Container read = read_container(path_);
  EXPECT_EQ(read.text, written.text);
  ASSERT_EQ(read.tensors.size(), written.tensors.size());
  for (std::size_t i = 0; i < read.tensors.size(); ++i) {
    EXPECT_EQ(read.tensors[i].name, written.tensors[i].name);
    EXPECT_EQ(read.tensors[i].tensor.scalar_type(), written.tensors[i].tensor.scalar_type());
    EXPECT_TRUE(torch::equal(read.tensors[i].tensor, written.tensors[i].tensor)) << read.tensors[i].name;
  }
}

TEST_F(ContainerFile, StoresViewsAndParametersByValue) {
  const torch::Tensor matrix = torch::randn({4, 6}).requires_grad_();
  write_container(path_, {{}, {{"turned", matrix.t()}, {"part", matrix.narrow(1, 2, 3)}}});
  const Container read = read_container(path_);
  EXPECT_TRUE(torch::equal(read.tensors[0].tensor, matrix.t()));
  EXPECT_TRUE(torch::equal(read.tensors[1].tensor, matrix.narrow(1, 2, 3)));
  EXPECT_FALSE(read.tensors[0].tensor.requires_grad());
}

TEST_F(ContainerFile, TheSameContentIsTheSameFile) {
  write_container(path_, small());
  const Bytes first = bytes();
  write_container(path_, small());
  EXPECT_EQ(bytes(), first);
}

TEST_F(ContainerFile, RefusesTheFileCutAtEveryLength) {
  write_container(path_, small());
  const Bytes whole = bytes();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    put(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)));
    EXPECT_NE(complaint(), "") << "cut at " << length;
  }
}

TEST_F(ContainerFile, RefusesAFlippedBitInEveryByte) {
  write_container(path_, small());
  const Bytes whole = bytes();
  std::mt19937 random(5);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    Bytes damaged = whole;
    damaged[at] ^= static_cast<std::uint8_t>(1u << (random() % 8));
    put(damaged);
    EXPECT_NE(complaint(), "") << "byte " << at;
  }
}

TEST_F(ContainerFile, RefusesAppendedBytes) {
  write_container(path_, small());
  Bytes longer = bytes();
  longer.push_back('x');
  put(longer);
  EXPECT_NE(complaint(), "");
}

TEST_F(ContainerFile, NamesThePlaceOfWhatIsWrong) {
  const auto entry = [](const std::string& shape, const std::string& offset,
                        const std::string& dtype = "f32") {
    return R"({"name":"w","dtype":")" + dtype + R"(","shape":)" + shape + R"(,"offset":)" + offset + "}";
  };
  const auto header = [](const std::string& tensors) {
    return R"({"format":"flowscope-policy/1","text":{},"tensors":[)" + tensors + "]}";
  };
  put_sealed(header(entry("[2]", "0")), 8);
  ASSERT_EQ(complaint(), "");
  put_sealed(header(entry("[4]", "0")), 8);
  expect_complaint("tensor \"w\": ends 8 bytes behind the data");
  put_sealed(header(entry("[2]", "0")), 12);
  expect_complaint("data: 4 bytes belong to no tensor");
  put_sealed(header(entry("[2]", "4")), 12);
  expect_complaint("tensor \"w\": its data should begin at offset 0");
  put_sealed(header(entry("[1]", "0") + R"(,{"name":"v","dtype":"f32","shape":[2],"offset":0})"), 12);
  expect_complaint("tensor \"v\": its data should begin at offset 4");
  put_sealed(header(entry("[1]", "0") + "," + entry("[1]", "4")), 8);
  expect_complaint("tensor \"w\": appears twice");
  for (const char* shape : {"[1099511627776,1099511627776]", "[-1]", "[1.5]", "[18446744073709551615]", "{}",
                            "\"2\"", "[1,1,1,1,1,1,1,1,1]", "[4294967296,4294967296,4294967296,0]"}) {
    put_sealed(header(entry(shape, "0")), 8);
    expect_complaint("tensor \"w\": absurd shape");
  }
  put_sealed(header(entry("[2]", "0", "f64")), 8);
  expect_complaint("tensor \"w\": unknown dtype");
  put_sealed(R"({"format":"flowscope-policy/2","text":{},"tensors":[]})", 0);
  expect_complaint("header: its format is not \"flowscope-policy/1\"");
  put_sealed(R"({"format":"flowscope-policy/1","text":{"a":1},"tensors":[]})", 0);
  expect_complaint("header text \"a\": not a string");
  put_sealed(R"({"format":"flowscope-policy/1","text":{}})", 0);
  expect_complaint("header: ");
  put_sealed("[1,", 0);
  expect_complaint("header: ");
  put_sealed(std::string(200000, '['), 0);
  expect_complaint("header: nested too deeply");
  put(Bytes(100, 0xff));
  expect_complaint("byte 0: header length above 1 MiB");
  put({});
  expect_complaint("byte 0: only 0 bytes");
  std::filesystem::remove(path_);
  expect_complaint("file: cannot be opened");
}

TEST_F(ContainerFile, SurvivesRandomBytesBehindARightChecksum) {
  std::mt19937 random(8);
  const std::string good = R"({"format":"flowscope-policy/1","text":{"a":"b"},"tensors":[{"name":"w",)"
                           R"("dtype":"f32","shape":[2],"offset":0}]})";
  for (int round = 0; round < 400; ++round) {
    std::string header = good;
    for (int k = 0; k < 3; ++k) header[random() % header.size()] = static_cast<char>(random() % 256);
    put_sealed(header, 8);
    try {
      const Container read = read_container(path_);
      EXPECT_LE(read.tensors.size(), 1u);
    } catch (const BadCheckpoint&) {
    }
  }
}

TEST_F(ContainerFile, DoesNotWriteWhatItCouldNotRead) {
  EXPECT_THROW(write_container(path_, {{}, {{"w", torch::zeros({2}, torch::kFloat64)}}}),
               std::invalid_argument);
  EXPECT_THROW(write_container(path_, {{}, {{"w", torch::Tensor()}}}), std::invalid_argument);
  EXPECT_THROW(write_container(path_, {{}, {{"w", torch::zeros({2})}, {"w", torch::zeros({2})}}}),
               std::invalid_argument);
  EXPECT_THROW(write_container(path_, {{{"text", "\xff\xfe"}}, {}}), std::invalid_argument);
  EXPECT_THROW(write_container(path_, {{{"text", std::string(2 << 20, 'x')}}, {}}), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace flowscope
