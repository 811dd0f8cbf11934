// Which changes a training sample goes through before each step.
#pragma once

#include <string>

namespace flowscope {

struct Augmentation {
  bool move = true;     ///< turned about world z, shifted and lifted: scene, history and target together
  bool recolor = true;  ///< colours of points, patches and colour words turned together
  bool shuffle = true;  ///< the things on the table moved about, each with the target that belongs to it
  bool crop = false;    ///< the paper's: pictures and XYZ maps resized and cropped together (picture_crop.h)
  bool repaint = true;  ///< mostly instead of recolor: each like-coloured part a colour of its own,
                        ///< and words with theirs (recolor.h)

  static Augmentation none() { return {false, false, false, false, false}; }
  bool any() const { return move || recolor || repaint || shuffle || crop; }
  bool operator==(const Augmentation&) const = default;
};

/// "default", "none", or names from move, recolor, repaint, shuffle, crop with commas between them. Throws
/// std::invalid_argument naming the one that is none of them.
Augmentation augmentation_of(const std::string& names);
/// The other way: "none" or the names.
std::string names_of(const Augmentation& augmentation);

}  // namespace flowscope
