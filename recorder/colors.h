// The benchmark's 20 colours, in its order: what tasks paint with and what a policy knows by name.
#pragma once

#include <array>
#include <string_view>

namespace flowscope {

struct NamedColor {
  std::string_view name;
  std::array<float, 3> rgb;  ///< linear, 0 … 1
};

inline constexpr std::array<NamedColor, 20> benchmark_colors{{
    {"red", {1, 0, 0}},        {"maroon", {.5f, 0, 0}},
    {"lime", {0, 1, 0}},       {"green", {0, .5f, 0}},
    {"blue", {0, 0, 1}},       {"navy", {0, 0, .5f}},
    {"yellow", {1, 1, 0}},     {"cyan", {0, 1, 1}},
    {"magenta", {1, 0, 1}},    {"silver", {.75f, .75f, .75f}},
    {"gray", {.5f, .5f, .5f}}, {"orange", {1, .5f, 0}},
    {"olive", {.5f, .5f, 0}},  {"purple", {.5f, 0, .5f}},
    {"teal", {0, .5f, .5f}},   {"azure", {0, .5f, 1}},
    {"violet", {.5f, 0, 1}},   {"rose", {1, 0, .5f}},
    {"black", {0, 0, 0}},      {"white", {1, 1, 1}},
}};

}  // namespace flowscope
