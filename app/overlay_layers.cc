#include "app/overlay_layers.h"

#include <utility>

namespace flowscope {
namespace {

template <typename Thing>
void append(std::vector<Thing>& all, const std::vector<Thing>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

bool is_empty(const Overlay& o) {
  return o.spheres.empty() && o.boxes.empty() && o.lines.empty() && o.points.empty() && o.frames.empty() &&
         o.ghosts.empty() && o.labels.empty();
}

}  // namespace

void OverlayLayers::set(const std::string& name, Overlay overlay) {
  if (is_empty(overlay)) {
    layers_.erase(name);
  } else {
    layers_[name] = std::move(overlay);
  }
}

Overlay OverlayLayers::all() const {
  Overlay sum;
  for (const auto& [name, layer] : layers_) {
    append(sum.spheres, layer.spheres);
    append(sum.boxes, layer.boxes);
    append(sum.lines, layer.lines);
    append(sum.points, layer.points);
    append(sum.frames, layer.frames);
    append(sum.ghosts, layer.ghosts);
    append(sum.labels, layer.labels);
  }
  return sum;
}

}  // namespace flowscope
