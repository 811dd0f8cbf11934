#include <string.h>  // strverscmp

#include <algorithm>
#include <cmath>

#include "recorder/demo_file.h"
#include "recorder/formats/demo_arrays.h"
#include "recorder/formats/npz_file.h"
#include "recorder/formats/png_file.h"
#include "recorder/formats/rlbench_camera.h"
#include "recorder/formats/rlbench_episode.h"

namespace flowscope {
namespace {

namespace fs = std::filesystem;

ImageRgb read_picture(const fs::path& file, const CameraModel& camera) {
  try {
    return image_of_png(read_demo_bytes(file), camera.width, camera.height);
  } catch (const BadDemo&) {
    throw;  // names the file already
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

/// The 24 bits are finer than what a demonstration's file keeps: its own steps give back the very same
/// numbers.
DepthImage in_steps_of(double unit_m, DepthImage depth) {
  for (float& z : depth.data) z = static_cast<float>(std::round(z / unit_m) * unit_m);
  return depth;
}

void read_pictures(const fs::path& episode, std::size_t index, const std::vector<ViewLayout>& layouts,
                   Observation& observation) {
  const std::string file = std::to_string(index) + ".png";
  for (std::size_t v = 0; v < layouts.size(); ++v) {
    View& view = observation.views[v];
    const CameraModel& camera = view.camera;
    view.rgb = read_picture(episode / (camera.name + "_rgb") / file, camera);
    view.depth = in_steps_of(
        layouts[v].depth_unit_m,
        unpack_rlbench_depth(read_picture(episode / (camera.name + "_depth") / file, camera), camera));
  }
}

}  // namespace

std::vector<fs::path> find_rlbench_episodes(const fs::path& root) {
  if (!fs::is_directory(root)) throw std::runtime_error(root.string() + ": there is no such folder");
  std::vector<fs::path> episodes;
  const auto add = [&](const fs::path& folder) {
    if (!fs::exists(folder / "low_dim_obs.pkl")) return;
    if (!fs::exists(folder / "flowscope.npz")) {
      throw std::runtime_error(
          folder.string() + ": was not written by flowscope: it has no flowscope.npz with the exact frames");
    }
    episodes.push_back(folder);
  };
  add(root);
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.is_directory() && !entry.path().filename().string().starts_with('.')) add(entry.path());
  }
  if (episodes.empty()) throw std::runtime_error(root.string() + ": holds no episode (no low_dim_obs.pkl)");
  std::ranges::sort(episodes, [](const fs::path& a, const fs::path& b) {
    return ::strverscmp(a.c_str(), b.c_str()) < 0;  // episode10 comes after episode9
  });
  return episodes;
}

Demo read_rlbench_episode(const fs::path& episode) {
  const fs::path side_file = episode / "flowscope.npz";
  const NpzReader npz(side_file);
  Demo demo = demo_from_arrays(
      [&](const std::string& name, const ArraySpec& expected) { return npz.read(name, expected); },
      ArrayParts::without_pictures, side_file.string() + ": ");
  const NamedArray text = npz.read("header", {}), pictures = npz.read("pictures", {});
  const DemoHeader header = parse_demo_header({text.data.begin(), text.data.end()});
  const bool all_frames = std::string(pictures.data.begin(), pictures.data.end()) == "all";
  read_pictures(episode, 0, header.observations.front(), demo.start);
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    Keyframe& keyframe = demo.keyframes[k];
    read_pictures(episode, all_frames ? static_cast<std::size_t>(keyframe.frame) : k + 1,
                  header.observations[k + 1], keyframe.observation);
  }
  return demo;
}

}  // namespace flowscope
