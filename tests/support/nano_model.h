// Small untrained models of every kind, and a scene to show them.
#pragma once

#include <ostream>
#include <string>

#include "policy/model.h"
#include "policy/sample.h"
#include "tests/support/synthetic_demo.h"

namespace flowscope::testing {

/// How the tokens stand: the paper's one sequence, or its unchanging part first, carried by the history's
/// tokens or by the stored state.
enum class TokenOrder { paper, carried, stored };
inline constexpr TokenOrder token_orders[] = {TokenOrder::paper, TokenOrder::carried, TokenOrder::stored};

inline const char* name_of(TokenOrder order) {
  return order == TokenOrder::paper ? "paper" : order == TokenOrder::carried ? "carried" : "stored";
}

struct NanoKind {
  std::string backbone = "mamba", objective = "cfm";
  TokenOrder order = TokenOrder::carried;
  bool grounded = true;

  std::string name() const {
    return backbone + ", " + objective + ", " + name_of(order) + (grounded ? ", grounded" : ", plain");
  }
};

inline std::ostream& operator<<(std::ostream& out, const NanoKind& kind) { return out << kind.name(); }

inline const Demo& nano_demo() {
  static const Demo made = toy_push_buttons(3);
  return made;
}

/// As a trainer makes it, but for the adaptive norms: they start at zero, where a condition would not count.
inline Model nano_model(const NanoKind& kind) {
  Preset preset = load_preset("nano");
  preset.shape.paper_order = kind.order == TokenOrder::paper;
  preset.shape.stored_state = kind.order == TokenOrder::stored;
  preset.shape.grounded = kind.grounded;
  Model model = make_model(preset.shape, preset.radius, kind.backbone, kind.objective, 7);
  const torch::NoGradGuard no_grad;
  for (const auto& item : model.network->named_parameters())
    if (item.key().find("adaptive") != std::string::npos) item.value().normal_(0, 0.05);
  model.vocabulary.learn(nano_demo().info.instruction);
  model.bounds = nano_demo().bounds;
  model.scale = PositionScale::from_bounds(model.bounds);
  return model;
}

/// The scene before the demonstration's second keyframe.
inline const SceneInput& nano_scene() {
  static const SceneInput prepared = [] {
    const Model model = nano_model({});
    return prepare_input(input_of_keyframe(nano_demo(), 1), model.bounds, model.shape, model.vocabulary);
  }();
  return prepared;
}

}  // namespace flowscope::testing
