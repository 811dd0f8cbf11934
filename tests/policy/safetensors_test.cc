#include "policy/safetensors.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <random>

#include "policy/policy.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using Bytes = std::vector<std::uint8_t>;

class SafetensorsFile : public ::testing::Test {
 protected:
  Bytes bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  void put(const Bytes& content) const {
    std::ofstream file(path_, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
  }
  void put(const std::string& header, const Bytes& data) const {
    Bytes content(8);
    const std::uint64_t length = header.size();
    std::memcpy(content.data(), &length, 8);
    content.insert(content.end(), header.begin(), header.end());
    content.insert(content.end(), data.begin(), data.end());
    put(content);
  }
  std::string complaint() const {
    try {
      read_safetensors(path_);
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

  static TensorsByName small() {
    torch::manual_seed(1);
    return {{"a.weight", torch::randn({3, 4})},
            {"steps", torch::arange(5, torch::kInt64)},
            {"mask", torch::tensor({1, 0, 1}, torch::kUInt8)},
            {"scalar", torch::tensor(2.5f)},
            {"none", torch::empty({0, 7})}};
  }
  static std::string entry(const std::string& name, const std::string& shape, const std::string& offsets,
                           const std::string& dtype = "F32") {
    return '"' + name + R"(":{"dtype":")" + dtype + R"(","shape":)" + shape + R"(,"data_offsets":)" +
           offsets + "}";
  }

  testing::TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.path() / "weights.safetensors";
};

TEST_F(SafetensorsFile, ReturnsWhatWasWritten) {
  write_safetensors(path_, small(), {{"name", "größe"}});
  TextByName metadata;
  const TensorsByName read = read_safetensors(path_, &metadata);
  EXPECT_EQ(metadata, (TextByName{{"name", "größe"}}));
  ASSERT_EQ(read.size(), small().size());
  for (const auto& [name, tensor] : small()) {
    ASSERT_TRUE(read.contains(name)) << name;
    EXPECT_EQ(read.at(name).scalar_type(), tensor.scalar_type()) << name;
    EXPECT_TRUE(torch::equal(read.at(name), tensor)) << name;
  }
}

TEST_F(SafetensorsFile, StoresViewsAndParametersByValue) {
  const torch::Tensor matrix = torch::randn({4, 6}).requires_grad_();
  write_safetensors(path_, {{"turned", matrix.t()}, {"spread", matrix.narrow(0, 1, 1).expand({3, 6})}});
  const TensorsByName read = read_safetensors(path_);
  EXPECT_TRUE(torch::equal(read.at("turned"), matrix.t()));
  EXPECT_TRUE(torch::equal(read.at("spread"), matrix.narrow(0, 1, 1).expand({3, 6})));
  EXPECT_FALSE(read.at("turned").requires_grad());
}

TEST_F(SafetensorsFile, TheSameContentIsTheSameFileAndItsDataLieAligned) {
  write_safetensors(path_, small());
  const Bytes first = bytes();
  write_safetensors(path_, small());
  EXPECT_EQ(bytes(), first);
  std::uint64_t header = 0;
  std::memcpy(&header, first.data(), 8);
  EXPECT_EQ(header % 8, 0u);
  EXPECT_EQ(first[8], '{');
}

// The bytes are spelled out here: writer and reader must not merely agree with each other.
TEST_F(SafetensorsFile, ReadsEveryDtype) {
  put("{" + entry("f16", "[2]", "[0,4]", "F16") + "," + entry("bf16", "[1]", "[4,6]", "BF16") + "," +
          entry("bool", "[2]", "[6,8]", "BOOL") + "," + entry("f64", "[1]", "[8,16]", "F64") + "," +
          entry("i32", "[]", "[16,20]", "I32") + "," + entry("i64", "[1]", "[20,28]", "I64") + "," +
          entry("u8", "[1]", "[28,29]", "U8") + R"(, "__metadata__":{"from":"a test"}}   )",
      {0x00, 0x3c, 0x00, 0xc0, 0x40, 0x40, 1, 0, 0, 0, 0, 0, 0,    0,  0x04,
       0xc0, 0xfe, 0xff, 0xff, 0xff, 0x07, 0, 0, 0, 0, 0, 0, 0x80, 200});
  TextByName metadata;
  TensorsByName read = read_safetensors(path_, &metadata);
  EXPECT_EQ(metadata.at("from"), "a test");
  EXPECT_TRUE(torch::equal(read.at("f16"), torch::tensor({1.f, -2.f})));
  EXPECT_TRUE(torch::equal(read.at("bf16"), torch::tensor({3.f})));
  EXPECT_TRUE(torch::equal(read.at("f64"), torch::tensor({-2.5f})));
  EXPECT_TRUE(torch::equal(read.at("bool"), torch::tensor({true, false})));
  EXPECT_EQ(read.at("i32").dim(), 0);
  EXPECT_EQ(read.at("i32").item<int>(), -2);
  EXPECT_EQ(read.at("i64").item<std::int64_t>(), std::bit_cast<std::int64_t>(0x8000000000000007ull));
  EXPECT_EQ(read.at("u8").item<int>(), 200);
}

TEST_F(SafetensorsFile, RefusesTheFileCutAtEveryLengthAndLengthened) {
  write_safetensors(path_, small());
  const Bytes whole = bytes();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    put(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)));
    EXPECT_NE(complaint(), "") << "cut at " << length;
  }
  Bytes longer = whole;
  longer.push_back('x');
  put(longer);
  expect_complaint("data: 1 bytes belong to no tensor");
}

TEST_F(SafetensorsFile, NamesThePlaceOfWhatIsWrong) {
  const Bytes eight(8);
  put("{" + entry("w", "[2]", "[0,8]") + "}", eight);
  ASSERT_EQ(complaint(), "");
  put("{" + entry("w", "[4]", "[0,16]") + "}", eight);
  expect_complaint("tensor \"w\": ends 8 bytes behind the data");
  put("{" + entry("w", "[3]", "[0,8]") + "}", eight);
  expect_complaint("tensor \"w\": has 8 bytes where its shape needs 12");
  put("{" + entry("w", "[1]", "[4,0]") + "}", eight);
  expect_complaint("tensor \"w\": ends before it begins");
  put("{" + entry("v", "[1]", "[4,8]") + "," + entry("w", "[1]", "[0,4]") + "}", eight);
  ASSERT_EQ(complaint(), "") << "the order of the names is free";
  put("{" + entry("v", "[1]", "[0,4]") + "," + entry("w", "[1]", "[2,6]") + "}", Bytes(6));
  expect_complaint("tensor \"w\": overlaps the one before it");
  put("{" + entry("v", "[1]", "[0,4]") + "," + entry("w", "[1]", "[6,10]") + "}", Bytes(10));
  expect_complaint("tensor \"w\": begins 2 bytes behind the one before it");
  put("{" + entry("w", "[1]", "[4,8]") + "}", eight);
  expect_complaint("tensor \"w\": begins 4 bytes behind");
  put("{" + entry("w", "[1]", "[0,4]") + "," + entry("w", "[1]", "[4,8]") + "}", eight);
  expect_complaint("header: \"w\" appears twice");
  put(R"({"w":{"dtype":"F32","dtype":"F32","shape":[2],"data_offsets":[0,8]}})", eight);
  expect_complaint("header: \"dtype\" appears twice");
  for (const char* shape :
       {"[1099511627776,1099511627776]", "[-1]", "[1.5]", "[18446744073709551615]", "{}", "\"2\"",
        "[1,1,1,1,1,1,1,1,1]", "[4294967296,4294967296,4294967296,0]", "[0,1099511627776,1099511627776]"}) {
    put("{" + entry("w", shape, "[0,8]") + "}", eight);
    expect_complaint("tensor \"w\": absurd shape");
  }
  for (const char* offsets : {"[0]", "[0,8,8]", "[-8,0]", "[0.5,8]", "8", "[0,\"8\"]"}) {
    put("{" + entry("w", "[2]", offsets) + "}", eight);
    expect_complaint("tensor \"w\": data_offsets are not");
  }
  put("{" + entry("w", "[2]", "[0,8]", "F8_E4M3") + "}", eight);
  expect_complaint("tensor \"w\": unknown dtype \"F8_E4M3\"");
  put(R"({"w":{"dtype":"F32","shape":[2]}})", eight);
  expect_complaint("tensor \"w\": is not {dtype, shape, data_offsets}");
  put("{" + entry("b", "[1]", "[0,1]", "BOOL") + "}", {2});
  expect_complaint("tensor \"b\": holds a truth value");
  put(R"({"__metadata__":{"a":1}})", {});
  expect_complaint("__metadata__ \"a\": is not a string");
  put(R"({"__metadata__":[]})", {});
  expect_complaint("__metadata__: is not an object");
  put("[]", {});
  expect_complaint("header: is not a JSON object");
  put(R"({"w":)", {});
  expect_complaint("header: ");
  put(R"({"w":)" + std::string(200000, '['), {});
  expect_complaint("header: nested too deeply");
  put(Bytes(100, 0xff));
  expect_complaint("byte 0: header length above 16 MiB");
  put({200, 0, 0, 0, 0, 0, 0, 0, '{', '}'});
  expect_complaint("byte 0: header of 200 bytes does not fit");
  std::filesystem::remove(path_);
  expect_complaint("file: cannot be opened");
}

TEST_F(SafetensorsFile, SurvivesRandomHeadersAndRandomFiles) {
  std::mt19937 random(8);
  const std::string good = "{" + entry("w", "[2]", "[0,8]") + "," + entry("v", "[2,1]", "[8,12]", "F16") +
                           R"(,"__metadata__":{"a":"b"}})";
  put(good, Bytes(12));
  ASSERT_EQ(complaint(), "");
  int refused = 0;
  for (int round = 0; round < 200; ++round) {
    std::string header = good;
    for (int k = 0; k < 3; ++k) header[random() % header.size()] = static_cast<char>(random() % 128);
    put(header, Bytes(12));
    refused += !complaint().empty();
    Bytes noise(random() % 64);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    if (noise.size() > 8) std::memset(noise.data() + 1, 0, 7);
    put(noise);
    EXPECT_NE(complaint(), "");
  }
  EXPECT_GT(refused, 100);
}

TEST_F(SafetensorsFile, DoesNotWriteWhatItCouldNotRead) {
  EXPECT_THROW(write_safetensors(path_, {{"w", torch::zeros({2}, torch::kFloat64)}}), std::invalid_argument);
  EXPECT_THROW(write_safetensors(path_, {{"w", torch::Tensor()}}), std::invalid_argument);
  EXPECT_THROW(write_safetensors(path_, {{"__metadata__", torch::zeros({2})}}), std::invalid_argument);
  EXPECT_THROW(write_safetensors(path_, {{"\xff\xfe", torch::zeros({2})}}), std::invalid_argument);
  EXPECT_THROW(write_safetensors(path_, {}, {{"text", "\xff\xfe"}}), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace flowscope
