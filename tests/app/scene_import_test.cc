// flowscope scene import, from the call to the file.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_command.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::contains;
using testing::run_command;

class SceneImport : public ::testing::Test {
 protected:
  std::string mesh(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return (folder_.path() / name).string();
  }
  std::string out() const { return (folder_.path() / "bracket").string(); }
  testing::TemporaryFolder folder_;
};

TEST_F(SceneImport, WritesAnObjectAndSaysWhatItIs) {
  const std::string file = mesh("bracket.obj", testing::as_obj(testing::l_shape(), 1000));
  const auto done =
      run_command({"scene", "import", file, "--out", out(), "--units", "mm", "--mass", "0.2", "--json"});
  ASSERT_EQ(done.code, 0) << done.err;
  const auto json = nlohmann::json::parse(done.out);
  EXPECT_EQ(json.at("name"), "bracket");
  EXPECT_EQ(json.at("parts"), 2);
  EXPECT_TRUE(json.at("closed"));
  EXPECT_EQ(json.at("mass_kg"), 0.2);
  EXPECT_NEAR(json.at("size_m").at(0).get<double>(), 0.1, 1e-6);
  EXPECT_NEAR(json.at("volume_m3").get<double>(), 96e-6, 1e-9);
  for (const auto& written : json.at("files"))
    EXPECT_TRUE(std::filesystem::exists(written.get<std::string>()));
  const auto again = run_command({"scene", "import", file, "--out", out(), "--units", "mm"});
  EXPECT_EQ(again.code, 2);
  EXPECT_TRUE(contains(again.err, "already there")) << again.err;
}

TEST_F(SceneImport, TellsWhatItLeavesOut) {
  mesh("bracket.mtl", "newmtl skin\nKd 0.5 0.25 0\nmap_Kd none.png\n");
  const std::string text = "mtllib bracket.mtl\nvt 0 0\nusemtl skin\n" + testing::as_obj(testing::l_shape());
  const auto done = run_command({"scene", "import", mesh("bracket.obj", text), "--out", out(), "--json"});
  ASSERT_EQ(done.code, 0) << done.err;
  EXPECT_TRUE(contains(done.err, "none.png")) << done.err;
  const auto json = nlohmann::json::parse(done.out);
  EXPECT_EQ(json.at("textures"), 0);
  ASSERT_EQ(json.at("left_out").size(), 1u);
  EXPECT_TRUE(contains(json.at("left_out").at(0), "is not there"));
}

TEST_F(SceneImport, SaysWhatItsPartsFillInAndHowToDoBetter) {
  const std::string file = mesh("washer.obj", testing::as_obj(testing::ring(24, 0.05, 24, 0.03, 0.01)));
  const auto coarse = run_command({"scene", "import", file, "--out", out(), "--parts", "4", "--json"});
  ASSERT_EQ(coarse.code, 0) << coarse.err;
  EXPECT_TRUE(contains(coarse.err, "holes are filled")) << coarse.err;
  EXPECT_TRUE(contains(coarse.err, "try --parts 8")) << coarse.err;
  const auto few = nlohmann::json::parse(coarse.out);
  EXPECT_EQ(few.at("parts"), 4);
  EXPECT_GT(few.at("excess").get<double>(), 0.05);
  EXPECT_TRUE(contains(few.at("filled_in"), "try --parts 8"));
  const auto fine = run_command({"scene", "import", file, "--out", out(), "--name", "fine", "--json"});
  ASSERT_EQ(fine.code, 0) << fine.err;
  EXPECT_FALSE(contains(fine.err, "holes are filled")) << fine.err;
  EXPECT_LT(nlohmann::json::parse(fine.out).at("excess").get<double>(), 0.02);
}

TEST_F(SceneImport, RefusesAFileThatNeedsWhatIsNotRead) {
  const std::string file =
      mesh("odd.gltf", R"({"asset":{"version":"2.0"},"extensionsRequired":["VENDOR_folded_space"]})");
  const auto refused = run_command({"scene", "import", file, "--out", out()});
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "odd.gltf: needs the extension VENDOR_folded_space")) << refused.err;
}

TEST_F(SceneImport, WrongCallsSayWhatIsWrong) {
  const std::string file = mesh("bracket.obj", testing::as_obj(testing::l_shape(), 1000));
  const auto too_large = run_command({"scene", "import", file, "--out", out()});
  EXPECT_EQ(too_large.code, 2);
  EXPECT_TRUE(contains(too_large.err, "--units")) << too_large.err;
  EXPECT_EQ(run_command({"scene", "import", file}).code, 2);
  EXPECT_EQ(run_command({"scene", "import", file, "--out", out(), "--scale", "0.001", "--units", "mm"}).code,
            2);
  EXPECT_EQ(run_command({"scene", "import", file, "--out", out(), "--scale", "-1"}).code, 2);
  const auto unknown = run_command({"scene", "import", mesh("a.step", "x"), "--out", out()});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(contains(unknown.err, "a.step")) << unknown.err;
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "bracket" / "bracket.xml"));
}

}  // namespace
}  // namespace flowscope
