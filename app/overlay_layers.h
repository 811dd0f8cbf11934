// What several parts of the program draw over the picture at the same time.
#pragma once

#include <map>
#include <string>

#include "render/overlay.h"

namespace flowscope {

/// Named overlays that are drawn together (trace, waypoints, failure, detectors): whoever owns a name changes
/// only what it has drawn itself. A value: no locks.
class OverlayLayers {
 public:
  /// Replaces the layer; an empty overlay takes it away.
  void set(const std::string& name, Overlay overlay);
  /// All layers as one, in the order of their names.
  Overlay all() const;

 private:
  std::map<std::string, Overlay> layers_;
};

}  // namespace flowscope
