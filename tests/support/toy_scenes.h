// Prepared scenes and draws of the toy tasks, for tests of the network by itself.
#pragma once

#include <vector>

#include "policy/batch.h"
#include "policy/model.h"
#include "tests/support/synthetic_demo.h"

namespace flowscope::testing {

/// A fresh network and as many scenes as wanted, with `draws` noisy poses each (scene-major).
struct ToyScenes {
  Model model;
  std::vector<SceneInput> inputs;
  std::vector<Draw> draws;

  ToyScenes(const NetworkShape& shape, int scenes, int draws_per_scene, const std::string& backbone = "mamba")
      : model(make_model(shape, RadiusSchedule{}, backbone, "cfm", 11)) {
    const Demo demo = toy_push_buttons(3);
    model.vocabulary.learn(demo.info.instruction);
    model.bounds = demo.bounds;
    model.scale = PositionScale::from_bounds(demo.bounds);
    Random random(4);
    for (int s = 0; s < scenes; ++s) {
      const int k = s % static_cast<int>(demo.keyframes.size());
      inputs.push_back(prepare_input(input_of_keyframe(demo, k), model.bounds, shape, model.vocabulary));
      for (int d = 0; d < draws_per_scene; ++d) {
        Draw draw;
        for (double& v : draw.x) v = random.normal();
        draw.t = random.uniform();
        draw.radius_m = model.radius.radius_m(draw.t);
        draws.push_back(draw);
      }
    }
  }
  std::vector<const SceneInput*> scenes(std::size_t first, std::size_t count) const {
    std::vector<const SceneInput*> out;
    for (std::size_t s = first; s < first + count; ++s) out.push_back(&inputs[s]);
    return out;
  }
  /// The network's answer for scenes first … first + count - 1 and their draws.
  NetworkOutput answer(FlowRamNetwork& network, std::size_t first, std::size_t count) const {
    const std::size_t each = draws.size() / inputs.size();
    const auto begin = draws.begin() + static_cast<std::ptrdiff_t>(first * each);
    const std::vector<Draw> part(begin, begin + static_cast<std::ptrdiff_t>(count * each));
    const SceneMemory memory =
        network->encode(make_scene_batch(scenes(first, count), model.shape, model.scale));
    return network->forward(memory, make_draw_batch(scenes(first, count), part, model.shape, model.scale),
                            model.scale);
  }
};

/// Small enough for a test of milliseconds.
inline NetworkShape toy_shape() {
  NetworkShape shape = load_preset("nano").shape;
  shape.channels = 16;
  shape.image_tokens = shape.region_points = 12;
  shape.scene_points = 512;
  return shape;
}

}  // namespace flowscope::testing
