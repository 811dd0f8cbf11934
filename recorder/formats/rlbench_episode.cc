#include "recorder/formats/rlbench_episode.h"

#include <system_error>

#include "recorder/atomic_file.h"
#include "recorder/formats/demo_arrays.h"
#include "recorder/formats/npz_file.h"
#include "recorder/formats/png_file.h"
#include "recorder/formats/rlbench_camera.h"
#include "recorder/formats/rlbench_pickles.h"
#include "recorder/new_folder.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;

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

RlbenchMoment write_pictures(const NewFolder& episode, const Demo& demo, int frame, std::size_t index,
                             const ExportSource& source) {
  const Observation observation = observation_of(demo, frame, source);
  RlbenchMoment moment{&demo.frames.at(static_cast<std::size_t>(frame)), {}};
  const std::string file = std::to_string(index) + ".png";
  for (const View& view : observation.views) {
    if (!is_plain_name(view.camera.name)) {
      throw std::invalid_argument("camera \"" + view.camera.name + "\": not a plain name");
    }
    episode.write(fs::path(view.camera.name + "_rgb") / file, png_of(view.rgb));
    episode.write(fs::path(view.camera.name + "_depth") / file,
                  png_of(pack_rlbench_depth(view.depth, view.camera)));
    moment.cameras.push_back(view.camera);
  }
  return moment;
}

void write_side_file(const NewFolder& episode, const fs::path& named, const Demo& demo,
                     const RlbenchOptions& options) {
  try {
    NpzWriter npz(episode.path() / "flowscope.npz");
    for (const NamedArray& array : arrays_of(demo, ArrayParts::without_pictures)) npz.add(array);
    npz.add(text_array("pictures", options.all_frames ? "all" : "keyframes"));
    npz.finish();
  } catch (const std::system_error& error) {  // it knows the temporary name only
    throw std::system_error(error.code(), "cannot write " + (named / "flowscope.npz").string());
  }
}

/// The first number that nobody has taken.
fs::path next_episode(const fs::path& episodes, int& number) {
  while (fs::exists(episodes / ("episode" + std::to_string(number)))) ++number;
  return episodes / ("episode" + std::to_string(number));
}

}  // namespace

fs::path write_rlbench_episode(const fs::path& root, const Demo& demo, const ExportSource& source,
                               const RlbenchOptions& options) {
  if (!is_plain_name(demo.info.task)) {
    throw std::invalid_argument("task \"" + demo.info.task + "\": not the name of a folder");
  }
  const fs::path variation =
      root / demo.info.task /
      (options.all_variations ? "all_variations" : "variation" + std::to_string(demo.info.variation));
  const fs::path episodes = variation / "episodes";
  int number = 0;
  fs::path episode = next_episode(episodes, number);
  NewFolder folder(root, episode);
  std::vector<RlbenchMoment> moments;
  for (const int frame : frames_to_write(demo, options)) {
    moments.push_back(write_pictures(folder, demo, frame, moments.size(), source));
  }
  folder.write("low_dim_obs.pkl", rlbench_low_dim_pickle(demo, moments, source));
  folder.write("variation_number.pkl", rlbench_variation_pickle(demo));
  folder.write("variation_descriptions.pkl", rlbench_descriptions_pickle(demo));
  write_side_file(folder, episode, demo, options);
  folder.sync();
  NewFolders above(episodes, episode);
  // Older readers look for the sentences once per variation.
  if (!options.all_variations) {
    write_file_atomically(variation / "variation_descriptions.pkl", rlbench_descriptions_pickle(demo));
  }
  // Never over an episode that is there, even one that another program has just put there.
  while (!folder.become(episode)) episode = next_episode(episodes, ++number);
  above.keep();
  return episode;
}

}  // namespace flowscope
