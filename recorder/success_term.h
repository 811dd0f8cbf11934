// What a success term says of a moment: for people, for machines, and as a thing to draw.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/pose.h"

namespace flowscope {

/// The number behind a term. It holds while `value` is above the threshold, or at or below it.
struct TermMeasure {
  double value = 0, threshold = 0;
  std::string unit;   ///< m, rad; empty: 1 for held, 0 for free
  bool above = true;  ///< which side of the threshold is wanted

  bool operator==(const TermMeasure&) const = default;
};

/// One success term as the page and a failed run show it.
struct SuccessTerm {
  std::string name;   ///< as in task.yaml
  bool met = false;   ///< in in_order: its turn came and it became true
  std::string value;  ///< the measured quantity with its unit
  /// Place in the success tree of task.yaml, counted from 0: all/1/in_order/0. Empty: the term is the tree.
  std::string path = {};
  std::optional<TermMeasure> measure = {};
  std::optional<double> first_met_s = {};  ///< seconds of the episode
};

/// What a term watches, as a shape in world metres at one moment.
struct Detector {
  enum class Shape { box, sphere, track };
  std::string name;   ///< the term's
  std::string place;  ///< the site, frame or joint it stands at: terms that watch one place have one
  bool met = false;
  Shape shape = Shape::box;
  Pose world_from_shape = {};                   ///< boxes and spheres
  Eigen::Vector3d half_size{0, 0, 0};           ///< boxes; a sphere's radius is its x
  std::vector<Eigen::Vector3d> track = {};      ///< from where it began to where it is met
  double reached = 0;                           ///< tracks: how far along it things are, 0 … 1
  std::optional<Eigen::Vector3d> subject = {};  ///< what has to get there
};

}  // namespace flowscope
