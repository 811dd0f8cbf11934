#include "render/encode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using testing::TemporaryFolder;

/// Red rises to the right, green downwards; blue is `blue`.
ImageRgb gradient(int width, int height, int blue) {
  ImageRgb image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y)[0] = static_cast<std::uint8_t>(255 * x / width);
      image.at(x, y)[1] = static_cast<std::uint8_t>(255 * y / height);
      image.at(x, y)[2] = static_cast<std::uint8_t>(blue);
    }
  }
  return image;
}

ImageRgb decode(const std::vector<std::uint8_t>& bytes) {
  cv::Mat rgb;
  cv::cvtColor(cv::imdecode(bytes, cv::IMREAD_COLOR), rgb, cv::COLOR_BGR2RGB);
  ImageRgb image(rgb.cols, rgb.rows);
  std::copy(rgb.datastart, rgb.dataend, image.data.begin());
  return image;
}

int largest_difference(const ImageRgb& a, const ImageRgb& b) {
  int largest = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i)
    largest = std::max(largest, std::abs(a.data[i] - b.data[i]));
  return largest;
}

std::vector<std::uint8_t> contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen(command.c_str(), "r");
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  ::pclose(pipe);
  return text;
}

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(Encode, JpegKeepsColoursAndOrientation) {
  const ImageRgb image = gradient(101, 75, 40);
  JpegEncoder encoder;
  const ImageRgb back = decode(encoder.encode(image, 95));
  ASSERT_EQ(back.width, 101);
  ASSERT_EQ(back.height, 75);
  EXPECT_LT(largest_difference(image, back), 16);
  EXPECT_LT(encoder.encode(image, 20).size(), encoder.encode(image, 95).size());
}

TEST(Encode, PngIsLossless) {
  const TemporaryFolder folder;
  const ImageRgb image = gradient(33, 21, 200);
  write_png(folder.path() / "figures" / "a.png", image);
  EXPECT_EQ(decode(contents(folder.path() / "figures" / "a.png")), image);
  EXPECT_EQ(files_in(folder.path() / "figures"), 1u);
}

TEST(Encode, PngOfManySizesIsLosslessAndCanBeGivenUp) {
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 33}, {640, 1}, {5, 64}, {1024, 769}}) {
    const ImageRgb image = gradient(width, height, 7);
    EXPECT_EQ(decode(encode_png(image)), image) << width << "x" << height;
  }
  const TemporaryFolder folder;
  int calls = 0;
  const auto give_up = [&] {
    if (++calls == 3) throw std::runtime_error("enough");
  };
  EXPECT_THROW(write_png(folder.path() / "a.png", gradient(64, 2000, 0), give_up), std::runtime_error);
  EXPECT_EQ(calls, 3);
  EXPECT_EQ(files_in(folder.path()), 0u);
}

TEST(Encode, RefusesTornPictures) {
  ImageRgb torn(8, 8);
  torn.data.pop_back();
  EXPECT_THROW(JpegEncoder().encode(torn), std::invalid_argument);
  EXPECT_THROW(encode_png(ImageRgb()), std::invalid_argument);
}

TEST(Encode, UnwritablePlacesAreNamed) {
  try {
    write_png("/proc/flowscope/a.png", gradient(4, 4, 0));
    FAIL() << "wrote into /proc";
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find("/proc/flowscope"), std::string::npos) << e.what();
  }
}

TEST(Mp4, StopsWhileTheEncoderIsBusyAndLeavesNothing) {
  const TemporaryFolder folder;
  for (const bool at_the_end : {false, true}) {
    std::stop_source stop;
    Mp4Writer writer(folder.path() / "a.mp4", 1920, 1080, 20, stop.get_token());
    const ImageRgb frame = gradient(1920, 1080, 90);
    for (int i = 0; i < 30; ++i) writer.add(frame);
    stop.request_stop();
    if (at_the_end)
      EXPECT_THROW(writer.finish(), std::runtime_error);
    else
      EXPECT_THROW(writer.add(frame), std::runtime_error);
  }
  EXPECT_EQ(files_in(folder.path()), 0u);
}

TEST(Mp4, PlaysAnywhere) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.mp4";
  Mp4Writer writer(path, 97, 64, 20);  // odd: one column is added
  for (int i = 0; i < 25; ++i) writer.add(gradient(97, 64, 10 * i));
  EXPECT_FALSE(std::filesystem::exists(path));
  writer.finish();
  const std::string found = output_of(
      "ffprobe -v error -count_frames -show_entries "
      "stream=codec_name,pix_fmt,width,height,r_frame_rate,nb_read_frames "
      "-of default=noprint_wrappers=1 " +
      path.string());
  for (const char* line : {"codec_name=h264\n", "pix_fmt=yuv420p\n", "width=98\n", "height=64\n",
                           "r_frame_rate=20/1\n", "nb_read_frames=25\n"}) {
    EXPECT_NE(found.find(line), std::string::npos) << line << found;
  }
  const std::vector<std::uint8_t> bytes = contents(path);
  const auto find = [&](const std::string& tag) {
    return std::search(bytes.begin(), bytes.end(), tag.begin(), tag.end());
  };
  ASSERT_NE(find("moov"), bytes.end());
  EXPECT_LT(find("moov"), find("mdat")) << "the index is not at the front";
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(Mp4, LeavesNothingWithoutFinish) {
  const TemporaryFolder folder;
  {
    Mp4Writer writer(folder.path() / "a.mp4", 32, 32, 10);
    writer.add(gradient(32, 32, 0));
    EXPECT_THROW(writer.add(gradient(16, 32, 0)), std::invalid_argument);
  }
  EXPECT_EQ(files_in(folder.path()), 0u);
}

TEST(Mp4, AVideoWithoutFramesIsAnError) {
  const TemporaryFolder folder;
  Mp4Writer writer(folder.path() / "a.mp4", 32, 32, 10);
  EXPECT_THROW(writer.finish(), std::runtime_error);
  EXPECT_THROW(Mp4Writer(folder.path() / "b.mp4", 0, 32, 10), std::invalid_argument);
}

TEST(Mp4, SaysThatFfmpegIsMissing) {
  const TemporaryFolder folder;
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", "/nowhere", 1);
  std::string message;
  try {
    Mp4Writer(folder.path() / "a.mp4", 32, 32, 10);
  } catch (const std::runtime_error& e) {
    message = e.what();
  }
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_NE(message.find("ffmpeg not found"), std::string::npos) << message;
}

}  // namespace
}  // namespace flowscope
