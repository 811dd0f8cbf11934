// Training in two real processes, started by mpirun as a user would.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "recorder/demo_store.h"
#include "tests/support/synthetic_demo.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

struct Ran {
  int code = -1;
  std::string out, err;
};

class MpiTrain : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("mpirun --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "there is no mpirun";
    const DemoStore store(data());
    store.save(testing::toy_push_buttons(3));
    store.save(testing::toy_open_drawer(1));
  }
  std::filesystem::path data() const { return folder_.path() / "data"; }
  std::string policy(const std::string& name) const { return (folder_.path() / (name + ".fsp")).string(); }
  std::string train(const std::filesystem::path& from, const std::string& name,
                    const std::string& options) const {
    return FLOWSCOPE_PROGRAM " train --json --preset nano --seed 5 --data " + from.string() + " --policy " +
           policy(name) + " " + options;
  }
  /// One machine, no network, more processes than cores, in a container.
  static std::string mpirun() {
    return "OMP_NUM_THREADS=1 OMPI_MCA_plm=isolated OMPI_MCA_oob_tcp_if_include=lo OMPI_MCA_btl=self,vader "
           "OMPI_MCA_btl_vader_single_copy_mechanism=none timeout 120 mpirun --allow-run-as-root "
           "--oversubscribe ";
  }
  Ran run(const std::string& command) const {
    const auto errors = folder_.path() / "errors";
    Ran ran;
    FILE* pipe = ::popen((command + " 2> " + errors.string()).c_str(), "r");
    std::array<char, 4096> part;
    while (const std::size_t n = std::fread(part.data(), 1, part.size(), pipe))
      ran.out.append(part.data(), n);
    const int status = ::pclose(pipe);
    ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    std::ifstream file(errors);
    ran.err.assign(std::istreambuf_iterator<char>(file), {});
    return ran;
  }
  /// The first moments of a policy file: after one step they are the clipped gradients times a constant.
  std::vector<float> moments(const std::string& name) const {
    std::ifstream file(policy(name), std::ios::binary);
    std::uint64_t length = 0;
    file.read(reinterpret_cast<char*>(&length), sizeof(length));
    std::string header(length, '\0');
    file.read(header.data(), static_cast<std::streamsize>(length));
    std::vector<float> all;
    const auto parsed = nlohmann::json::parse(header);
    for (const auto& tensor : parsed.at("tensors")) {
      if (tensor.at("name").get<std::string>().rfind("m/", 0) != 0) continue;
      std::size_t count = 1;
      for (const auto& side : tensor.at("shape")) count *= side.get<std::size_t>();
      const std::size_t at = all.size();
      all.resize(at + count);
      file.seekg(
          static_cast<std::streamoff>(sizeof(length) + length + tensor.at("offset").get<std::size_t>()));
      file.read(reinterpret_cast<char*>(&all[at]), static_cast<std::streamsize>(4 * count));
    }
    return all;
  }
  const testing::TemporaryFolder folder_;
};

TEST_F(MpiTrain, TwoProcessesHaveTheGradientsOfOneWithTwiceTheBatch) {
  const Ran alone = run(train(data(), "one", "--steps 1 --scenes 4"));
  ASSERT_EQ(alone.code, 0) << alone.err;
  const Ran both = run(mpirun() + "-n 2 " + train(data(), "two", "--steps 1 --scenes 2"));
  ASSERT_EQ(both.code, 0) << both.err;
  const auto one = nlohmann::json::parse(alone.out), two = nlohmann::json::parse(both.out);
  EXPECT_EQ(one["processes"], 1);
  EXPECT_EQ(two["processes"], 2);
  EXPECT_EQ(two["steps"], 1);
  EXPECT_NEAR(two["loss"].get<double>(), one["loss"].get<double>(), 1e-4 * one["loss"].get<double>());
  const std::vector<float> wanted = moments("one"), got = moments("two");
  ASSERT_GT(wanted.size(), 1000u);
  ASSERT_EQ(got.size(), wanted.size());
  double largest = 0, difference = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(wanted[i])));
    difference = std::max(difference, std::abs(static_cast<double>(wanted[i]) - static_cast<double>(got[i])));
  }
  EXPECT_GT(largest, 0);
  EXPECT_LT(difference, 1e-3 * largest);
}

TEST_F(MpiTrain, ProcessesWithOtherDemonstrationsEndWithAMessage) {
  const auto other = folder_.path() / "other";
  DemoStore(other).save(testing::toy_push_buttons(8));
  const Ran ran = run(mpirun() + "-n 1 " + train(data(), "a", "--steps 1000000") + " : -n 1 " +
                      train(other, "b", "--steps 1000000"));
  EXPECT_EQ(ran.code, 1) << ran.err;
  EXPECT_NE(ran.err.find("do not have the same demonstrations"), std::string::npos) << ran.err;
}

TEST_F(MpiTrain, AProcessThatFailsEndsTheOthers) {
  const Ran ran = run(mpirun() + "-n 1 " + train(data(), "a", "--steps 1000000") + " : -n 1 " +
                      train(folder_.path() / "nowhere", "b", "--steps 1000000"));
  EXPECT_EQ(ran.code, 2) << ran.err;
  EXPECT_NE(ran.err.find("process 1 of 2: --data"), std::string::npos) << ran.err;
}

}  // namespace
}  // namespace flowscope
