// The sizes and rates of a policy: assets/policies/<name>.yaml.
#pragma once

#include <string>

#include "policy/flow_trace.h"

namespace flowscope {

/// Everything that decides the shape of the network and of its inputs. Stored with the weights.
struct NetworkShape {
  int channels = 64;        ///< width C of every token
  int d_state = 8;          ///< Mamba state per channel
  int prefix_blocks = 1;    ///< fusion blocks over the unchanging tokens
  int point_blocks = 1;     ///< point encoder
  int fusion_blocks = 1;    ///< fusion over history, geometry and action tokens
  int velocity_blocks = 1;  ///< with adaptive layer norm
  int heads = 6;            ///< anchors of the grounded form
  int words = 24;           ///< instruction tokens
  int vocabulary = 256;     ///< rows of the word table
  int image_tokens = 64;    ///< semantic tokens, whole workspace
  int region_points = 64;   ///< geometry tokens, inside the sphere
  int scene_points = 4096;  ///< candidate points kept of one observation
  double voxel_m = 0.007;   ///< grid of the candidate points
  bool grounded = true;
  bool point_encoder = true;
  bool paper_order =
      false;  ///< one sequence [geometry, image, text, history, action] instead of the cached prefix
  bool stored_state = false;  ///< the cached prefix goes through every block, and each flow step runs on from
                              ///< its state; else only its history tokens stand before the geometry
  bool binding = true;  ///< every point token sees how well it matches each word before anything is pooled
  bool part_middles = false;  ///< small like-coloured parts have one middle, their outline's (part_middles.h)
  int point_groups = 0;       ///< PointMamba: groups of the point encoder; 0: it scans the points themselves
  int group_size = 16;        ///< points per group
  std::string image_branch = "patches";  ///< patches: learnt here; clip: frozen ResNet-50 with a pyramid
  std::string text_branch = "words";     ///< words: learnt here; clip: its text transformer
  bool operator==(const NetworkShape&) const = default;
};

struct TrainRates {
  int scenes = 8;  ///< observations per optimiser step
  int draws = 4;   ///< (noise, time) pairs per observation
  double learning_rate = 1e-3, weight_decay = 5e-4, beta1 = 0.9, beta2 = 0.99, clip = 1.0;
  int warmup_steps = 100;
  double ema = 0.998;
  double rotation_deg = 180;  ///< augmentation: about world z, uniform in +- this
  double shift_m = 0.10, lift_m = 0.03, jitter_m = 0.001;
  std::string times = "logit_normal";      ///< training times of flow matching: logit_normal, uniform, beta
  double shuffle = 0.7, shuffle_m = 0.25;  ///< how often things on the table are moved about, and how far
  bool operator==(const TrainRates&) const = default;
};

struct Preset {
  NetworkShape shape;
  TrainRates rates;
  RadiusSchedule radius;
};

/// Reads assets/policies/<name>.yaml. Throws std::invalid_argument naming the known presets, or file, line
/// and key.
Preset load_preset(const std::string& name);

}  // namespace flowscope
