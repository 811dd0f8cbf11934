#include "app/detector_overlay.h"

#include <algorithm>
#include <set>

#include "app/overlay_layers.h"

namespace flowscope {
namespace {

using Eigen::Vector3d;

/// Terms that watch one volume.
struct Watched {
  const Detector* shape = nullptr;
  std::set<std::string> terms{}, met{};  ///< names: a tree may ask the same thing in several places
};

bool same_volume(const Detector& a, const Detector& b) {
  return a.shape == b.shape && a.shape != Detector::Shape::track && a.place == b.place &&
         a.half_size == b.half_size && a.world_from_shape == b.world_from_shape;
}

Rgba color_of(bool met, float alpha) {
  Rgba color = met ? palette::met : palette::unmet;
  color[3] = alpha;
  return color;
}

std::string label_of(const Watched& watched) {
  if (watched.terms.size() == 1) return watched.shape->name;
  return watched.shape->place + ": " + std::to_string(watched.met.size()) + " of " +
         std::to_string(watched.terms.size());
}

OverlayLine line(std::vector<Vector3d> points, double width_m, const Rgba& color) {
  return {std::move(points), width_m, color, {}};
}

/// The way in full, thin; the part that lies behind, thick; a mark where it is met.
Vector3d add_track(const Detector& d, Overlay& overlay) {
  overlay.lines.push_back(line(d.track, 0.004, color_of(d.met, 0.9f)));
  const double last = static_cast<double>(d.track.size() - 1), at = std::clamp(d.reached, 0.0, 1.0) * last;
  const auto whole = static_cast<std::size_t>(at);
  std::vector<Vector3d> done(d.track.begin(), d.track.begin() + static_cast<std::ptrdiff_t>(whole) + 1);
  if (whole + 1 < d.track.size()) {
    const double part = at - static_cast<double>(whole);
    done.push_back((1 - part) * d.track[whole] + part * d.track[whole + 1]);
  }
  if (done.size() > 1) overlay.lines.push_back(line(done, 0.008, color_of(d.met, 0.9f)));
  overlay.points.push_back({{d.track.back()}, 0.014, color_of(d.met, 1)});
  return d.track.back();
}

/// Returns where its label stands.
Vector3d add_shape(const Watched& watched, Overlay& overlay) {
  const Detector& d = *watched.shape;
  const bool met = !watched.met.empty();
  if (d.shape == Detector::Shape::track) return add_track(d, overlay);
  const Vector3d center = d.world_from_shape.position;
  // What still has to get there is tied to where it has to get; with several terms the lines would say
  // nothing.
  if (d.subject && !met && watched.terms.size() == 1)
    overlay.lines.push_back(line({*d.subject, center}, 0.002, color_of(met, 0.9f)));
  if (d.shape == Detector::Shape::sphere) {
    overlay.spheres.push_back({center, d.half_size.x(), color_of(met, palette::met[3])});
    return center + Vector3d(0, 0, d.half_size.x());
  }
  overlay.boxes.push_back({d.world_from_shape, d.half_size, color_of(met, palette::met[3])});
  const Eigen::Matrix3d axes = d.world_from_shape.rotation.toRotationMatrix();
  return center + Vector3d(0, 0, (axes.cwiseAbs() * d.half_size).z());
}

}  // namespace

Overlay overlay_of(const std::vector<Detector>& detectors) {
  std::vector<Watched> volumes;
  for (const Detector& detector : detectors) {
    auto found =
        std::ranges::find_if(volumes, [&](const Watched& w) { return same_volume(*w.shape, detector); });
    if (found == volumes.end()) found = volumes.insert(volumes.end(), {&detector});
    found->terms.insert(detector.name);
    if (detector.met) found->met.insert(detector.name);
  }
  Overlay overlay;
  for (const Watched& watched : volumes) {
    const Vector3d label_at = add_shape(watched, overlay);
    overlay.labels.push_back({label_at, label_of(watched)});
  }
  return overlay;
}

DetectorReplay::DetectorReplay(std::shared_ptr<const Task> task, int variation, std::uint64_t seed)
    : world_(std::move(task)) {
  world_.reset(variation, seed);
}

Overlay DetectorReplay::at(const SceneState& state) {
  world_.follow(state);
  return overlay_of(world_.detectors());
}

Overlay detectors_of(const TaskLibrary& tasks, const Demo& demo, std::size_t frame) {
  DetectorReplay replay(tasks.get(demo.info.task), demo.info.variation, demo.info.seed);
  Overlay overlay;
  for (std::size_t i = 0; i <= frame; ++i) overlay = replay.at(demo.frames.at(i).state);
  return overlay;
}

Overlay detectors_of(const TaskLibrary& tasks, const FlowTrace& trace, const SceneState& state) {
  return DetectorReplay(tasks.get(trace.scene.task), trace.scene.variation, trace.scene.seed).at(state);
}

Overlay together(Overlay first, Overlay second) {
  OverlayLayers layers;
  layers.set("first", std::move(first));
  layers.set("second", std::move(second));
  return layers.all();
}

}  // namespace flowscope
