// The one list of a preset's fields: the YAML reader and the checkpoint both walk it.
#pragma once

#include "policy/preset.h"

namespace flowscope {

template <typename Shape, typename Visitor>
void visit_shape(Shape& s, Visitor&& field) {
  field("channels", s.channels);
  field("d_state", s.d_state);
  field("prefix_blocks", s.prefix_blocks);
  field("point_blocks", s.point_blocks);
  field("fusion_blocks", s.fusion_blocks);
  field("velocity_blocks", s.velocity_blocks);
  field("heads", s.heads);
  field("words", s.words);
  field("vocabulary", s.vocabulary);
  field("image_tokens", s.image_tokens);
  field("region_points", s.region_points);
  field("scene_points", s.scene_points);
  field("voxel_m", s.voxel_m);
  field("grounded", s.grounded);
  field("point_encoder", s.point_encoder);
  field("paper_order", s.paper_order);
}

/// Fields that older checkpoints do not have: they keep their defaults there.
template <typename Shape, typename Visitor>
void visit_later_shape(Shape& s, Visitor&& field) {
  field("stored_state", s.stored_state);
  field("binding", s.binding);
  field("part_middles", s.part_middles);
  field("point_groups", s.point_groups);
  field("group_size", s.group_size);
  field("image_branch", s.image_branch);
  field("text_branch", s.text_branch);
}

template <typename Rates, typename Visitor>
void visit_later_rates(Rates& r, Visitor&& field) {
  field("times", r.times);
  field("shuffle", r.shuffle);
  field("shuffle_m", r.shuffle_m);
}

template <typename Rates, typename Visitor>
void visit_rates(Rates& r, Visitor&& field) {
  field("scenes", r.scenes);
  field("draws", r.draws);
  field("learning_rate", r.learning_rate);
  field("weight_decay", r.weight_decay);
  field("beta1", r.beta1);
  field("beta2", r.beta2);
  field("clip", r.clip);
  field("warmup_steps", r.warmup_steps);
  field("ema", r.ema);
  field("rotation_deg", r.rotation_deg);
  field("shift_m", r.shift_m);
  field("lift_m", r.lift_m);
  field("jitter_m", r.jitter_m);
}

template <typename Radius, typename Visitor>
void visit_radius(Radius& r, Visitor&& field) {
  field("r_0_m", r.r_0);
  field("r_min_m", r.r_min);
}

}  // namespace flowscope
