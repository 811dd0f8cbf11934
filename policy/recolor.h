// Changes of colour that keep an instruction true: points, patches and colour words change together.
#pragma once

#include <vector>

#include "policy/random.h"
#include "policy/scene_points.h"
#include "policy/words.h"

namespace flowscope {

/// Everything turned about the grey axis, half of the time with two channels exchanged: keeps every distance
/// between colours.
void turn_colors(PreparedScene& scene, std::vector<Word>& words, Random& random);

/// Like-coloured parts of things: points within 25 mm of each other whose hue and brightness are near those
/// of the part's first point. -1 for points with `skip` and for those of parts with fewer than five points.
std::vector<int> find_parts(const std::vector<Eigen::Vector3f>& position,
                            const std::vector<Eigen::Vector3f>& color, const std::vector<char>& skip);

/// Every strongly coloured part takes a colour of the benchmark's, those that an instruction's word names the
/// word's new one and no other part that. What stays when all colours turn together, how a scene's colours
/// differ, tells few demonstrations apart; here nothing stays but that word and part agree. False, and
/// nothing changed, when a word names a grey (robot and table are grey too) or nothing in view.
bool repaint_parts(PreparedScene& scene, std::vector<Word>& words, Random& random);

}  // namespace flowscope
