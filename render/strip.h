// A figure strip: pictures side by side with a caption under each, as papers show the steps of a flow.
#pragma once

#include <string>
#include <vector>

#include "render/image.h"

namespace flowscope {

struct StripPanel {
  ImageRgb image;
  std::string caption;  ///< ASCII; one line, shrunk to the panel's width
};

struct StripStyle {
  int height = 480;  ///< pixels of each picture; widths follow from their shapes
  int gap = 12;      ///< pixels between pictures and around the strip
  int columns = 0;   ///< pictures in a row; 0: all in one
};

/// White ground, dark text. Throws std::invalid_argument when there is nothing to show or the strip would be
/// too large.
ImageRgb compose_strip(const std::vector<StripPanel>& panels, const StripStyle& style = {});

}  // namespace flowscope
