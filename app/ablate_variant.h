// What an ablation compares: one policy with some of its parts exchanged or taken out.
#pragma once

#include <compare>
#include <filesystem>
#include <string>
#include <vector>

namespace flowscope {

/// One way to train; what is not named here is the preset's.
struct AblationVariant {
  std::string backbone = "mamba";  ///< mamba, transformer
  std::string radius = "linear";   ///< Dynamic Radius Schedule: linear, cosine, off
  bool point_encoder = true;       ///< encoder over the geometry tokens
  std::string objective = "cfm";   ///< cfm, ddim, ddpm
  bool grounded = true;            ///< false: velocity straight from the action token, the paper's form
  bool binding = true;             ///< points know how well they match each word
  bool part_middles = true;        ///< small parts have one middle, their outline's
  // Augmentations (policy/augmentation.h).
  bool move = true, recolor = true, repaint = true, shuffle = true, crop = false;
  auto operator<=>(const AblationVariant&) const = default;
};

/// The one list of a variant's fields: keys, files and grids walk it.
template <typename Variant, typename Visitor>
void visit_variant(Variant& v, Visitor&& field) {
  field("backbone", v.backbone);
  field("radius", v.radius);
  field("point_encoder", v.point_encoder);
  field("objective", v.objective);
  field("grounded", v.grounded);
  field("binding", v.binding);
  field("part_middles", v.part_middles);
  field("move", v.move);
  field("recolor", v.recolor);
  field("repaint", v.repaint);
  field("shuffle", v.shuffle);
  field("crop", v.crop);
}

/// What differs from the full policy, fit for a file name: "full", "radius=off,objective=ddim", ….
std::string key_of(const AblationVariant& variant);

/// A variant at one number of flow steps; a policy is trained once for all its cells.
struct AblationCell {
  AblationVariant variant;
  int flow_steps = 4;
  auto operator<=>(const AblationCell&) const = default;
};

/// Every combination of the lists in a YAML file, in the order of visit_variant, the last field fastest:
/// fields of AblationVariant (on and off for the switches) and `flow_steps`; what is not named stays as it is
/// above. Throws std::invalid_argument naming file, line and key.
std::vector<AblationCell> read_grid(const std::filesystem::path& file);

}  // namespace flowscope
