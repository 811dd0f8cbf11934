#include "policy/augmentation.h"

#include <array>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace flowscope {
namespace {

constexpr std::array<std::pair<const char*, bool Augmentation::*>, 5> kinds{
    {{"move", &Augmentation::move},
     {"recolor", &Augmentation::recolor},
     {"repaint", &Augmentation::repaint},
     {"shuffle", &Augmentation::shuffle},
     {"crop", &Augmentation::crop}}};

}  // namespace

Augmentation augmentation_of(const std::string& names) {
  if (names == "default") return {};
  Augmentation out = Augmentation::none();
  if (names == "none") return out;
  if (names.empty()) throw std::invalid_argument("augmentation: name some, or say none");
  std::istringstream list(names);
  for (std::string name; std::getline(list, name, ',');) {
    bool known = false;
    for (const auto& [kind, member] : kinds)
      if (name == kind) out.*member = known = true;
    if (!known)
      throw std::invalid_argument("augmentation '" + name +
                                  "' is none of move, recolor, repaint, shuffle, crop, none, default");
  }
  return out;
}

std::string names_of(const Augmentation& augmentation) {
  std::string list;
  for (const auto& [kind, member] : kinds)
    if (augmentation.*member) list += (list.empty() ? "" : ",") + std::string(kind);
  return list.empty() ? "none" : list;
}

}  // namespace flowscope
