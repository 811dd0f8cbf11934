#include "recorder/formats/rlbench_episode.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>

#include "recorder/formats/demo_arrays.h"
#include "recorder/formats/npz_file.h"
#include "recorder/formats/png_file.h"
#include "recorder/formats/rlbench_camera.h"
#include "recorder/formats/rlbench_pickles.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;

void write_file(const fs::path& path, const Bytes& bytes) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) throw std::runtime_error(path.string() + ": cannot be written (disk full?)");
}

/// A folder that goes again unless it is moved to its place.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const fs::path& parent) {
    path_ = parent / (".flowscope-tmp-" + std::to_string(::getpid()));
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

  /// Everything in it reaches the disk with one call: an episode is a thousand files.
  void sync() const {
    const int folder = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const bool done = folder >= 0 && ::syncfs(folder) == 0;
    const int error = errno;
    if (folder >= 0) ::close(folder);
    if (!done) throw std::system_error(error, std::generic_category(), "cannot sync " + path_.string());
  }
  /// Never over an episode that is there, even one that another program has just put there.
  fs::path become_next_episode(const fs::path& episodes) {
    fs::create_directories(episodes);
    for (int number = 0;; ++number) {
      const fs::path target = episodes / ("episode" + std::to_string(number));
      if (fs::exists(target)) continue;
      if (::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target.c_str(), RENAME_NOREPLACE) == 0)
        return target;
      if (errno != EEXIST)
        throw std::system_error(errno, std::generic_category(), "cannot write " + target.string());
    }
  }

 private:
  fs::path path_;
};

std::vector<int> frames_to_write(const Demo& demo, const RlbenchOptions& options) {
  std::vector<int> frames;
  if (options.all_frames) {
    for (int i = 0; i < static_cast<int>(demo.frames.size()); ++i) frames.push_back(i);
  } else {
    frames.push_back(0);
    for (const Keyframe& keyframe : demo.keyframes) frames.push_back(keyframe.frame);
  }
  return frames;
}

Observation observation_of(const Demo& demo, int frame, const ExportSource& source) {
  if (source.observe) return source.observe(demo, frame);
  const Observation* stored = stored_observation(demo, frame);
  if (stored == nullptr) {
    throw std::invalid_argument("frame " + std::to_string(frame) + " has no picture and nobody to take one");
  }
  return *stored;
}

RlbenchMoment write_pictures(const fs::path& episode, const Demo& demo, int frame, std::size_t index,
                             const ExportSource& source) {
  const Observation observation = observation_of(demo, frame, source);
  RlbenchMoment moment{&demo.frames.at(static_cast<std::size_t>(frame)), {}};
  const std::string file = std::to_string(index) + ".png";
  for (const View& view : observation.views) {
    if (!is_plain_name(view.camera.name)) {
      throw std::invalid_argument("camera \"" + view.camera.name + "\": not a plain name");
    }
    const fs::path rgb = episode / (view.camera.name + "_rgb"),
                   depth = episode / (view.camera.name + "_depth");
    if (index == 0) fs::create_directory(rgb), fs::create_directory(depth);
    write_file(rgb / file, png_of(view.rgb));
    write_file(depth / file, png_of(pack_rlbench_depth(view.depth, view.camera)));
    moment.cameras.push_back(view.camera);
  }
  return moment;
}

void write_side_file(const fs::path& file, const Demo& demo, const RlbenchOptions& options) {
  NpzWriter npz(file);
  for (const NamedArray& array : arrays_of(demo, ArrayParts::without_pictures)) npz.add(array);
  npz.add(text_array("pictures", options.all_frames ? "all" : "keyframes"));
  npz.finish();
}

}  // namespace

fs::path write_rlbench_episode(const fs::path& root, const Demo& demo, const ExportSource& source,
                               const RlbenchOptions& options) {
  if (!is_plain_name(demo.info.task)) {
    throw std::invalid_argument("task \"" + demo.info.task + "\": not the name of a folder");
  }
  fs::create_directories(root);
  TemporaryFolder folder(root);
  std::vector<RlbenchMoment> moments;
  for (const int frame : frames_to_write(demo, options)) {
    moments.push_back(write_pictures(folder.path(), demo, frame, moments.size(), source));
  }
  write_file(folder.path() / "low_dim_obs.pkl", rlbench_low_dim_pickle(demo, moments, source));
  write_file(folder.path() / "variation_number.pkl", rlbench_variation_pickle(demo));
  write_file(folder.path() / "variation_descriptions.pkl", rlbench_descriptions_pickle(demo));
  write_side_file(folder.path() / "flowscope.npz", demo, options);
  folder.sync();
  const fs::path variation =
      root / demo.info.task /
      (options.all_variations ? "all_variations" : "variation" + std::to_string(demo.info.variation));
  const fs::path episode = folder.become_next_episode(variation / "episodes");
  // Older readers look for the sentences once per variation.
  if (!options.all_variations) {
    write_file(variation / "variation_descriptions.pkl", rlbench_descriptions_pickle(demo));
  }
  return episode;
}

}  // namespace flowscope
