#include "policy/cost.h"

#include <stdexcept>

#include "policy/batch.h"

namespace flowscope {
namespace {

using Count = std::int64_t;

constexpr Count time_features = 64, pose_values = 9, clip_text_width = 512;

/// Two layers, of width `channels` both.
Count mlp(Count rows, Count in, Count channels) { return rows * channels * (in + channels); }

/// `length` new tokens that also see `remembered` ones; `conditioned` by a vector of C numbers.
using Block = Work (*)(Count channels, Count d_state, Count length, Count remembered, bool conditioned);

Work mamba_block(Count c, Count d_state, Count length, Count /*remembered*/, bool conditioned) {
  const Count e = 2 * c, rank = (c + 15) / 16;
  const Count per_token = c * 2 * e + e * (rank + 2 * d_state) + rank * e + e * c;
  return {length * per_token + (conditioned ? c * 2 * c : 0), length * e * (4 + 3 * d_state)};
}

Work transformer_block(Count c, Count /*d_state*/, Count length, Count remembered, bool conditioned) {
  const Count wide = (3 * c + 1) / 2, seen = length + remembered;
  return {length * (4 * c * c + 2 * c * wide + 2 * seen * c) + (conditioned ? c * 4 * c : 0), 0};
}

Block block_of(const std::string& backbone) {
  if (backbone == "mamba") return mamba_block;
  if (backbone == "transformer") return transformer_block;
  throw std::invalid_argument("no cost is known of backbone '" + backbone + "'");
}

class Costs {
 public:
  Costs(const NetworkShape& shape, const std::string& backbone)
      : s_(shape),
        block_(block_of(backbone)),
        c_(shape.channels),
        words_(shape.words),
        image_(shape.image_tokens),
        points_(shape.region_points) {}

  std::map<std::string, PartWork> all() {
    count_scene();
    count_step();
    return parts_;
  }

 private:
  Work stack(int blocks, Count length, Count remembered, bool conditioned) const {
    Work sum;
    for (int i = 0; i < blocks; ++i) sum += block_(c_, s_.d_state, length, remembered, conditioned);
    return sum;
  }

  /// Points to tokens that know the words (point_tokens.h).
  Count point_tokens(Count points, Count features) const {
    const Count plain = points * features * c_ + 2 * points * c_ * c_;
    if (!s_.binding) return plain;
    return plain + points * c_ * c_ + 4 * points * words_ * c_;
  }
  Count word_keys() const { return s_.binding ? 4 * words_ * c_ * c_ : 0; }

  void count_scene() {
    parts_["word_color"].scene.products = words_ * 3 * c_;
    parts_["instruction"].scene.products = mlp(1, c_, c_);
    parts_["proprioception"].scene.products = mlp(1, history_features * history_length, c_);
    parts_["history"].scene.products = mlp(history_length, history_features, c_);
    if (s_.image_branch != "clip") parts_["patch"].scene.products = mlp(image_, patch_values, c_);
    if (s_.text_branch == "clip") parts_["word_feature"].scene.products = words_ * clip_text_width * c_;
    parts_["image_tokens"].scene.products = point_tokens(image_, point_features) + word_keys();
    parts_["region_tokens"].scene.products = word_keys();
    if (s_.grounded) parts_["grounding"].scene.products = seeking();
    if (s_.paper_order) return;
    const Count prefix = words_ + image_ + history_length;
    parts_["prefix"].scene = stack(s_.prefix_blocks, prefix, 0, false);
    if (!s_.stored_state) return;
    parts_["fusion"].scene = stack(s_.fusion_blocks, prefix, 0, false);
    parts_["velocity"].scene = stack(s_.velocity_blocks, prefix, 0, true);
  }

  void count_step() {
    parts_["time"].step.products = mlp(1, time_features, c_);
    parts_["pose"].step.products = mlp(1, pose_values, c_);
    parts_["region_tokens"].step.products = point_tokens(points_, region_features);
    const Count region = count_point_encoder();
    const Count before = words_ + image_ + history_length;
    Count length = history_length + region + 1, remembered = 0;
    if (s_.paper_order) length = before + region + 1;
    if (s_.stored_state && !s_.paper_order) length = region + 1, remembered = before;
    if (s_.paper_order) parts_["prefix"].step = stack(s_.prefix_blocks, length, 0, false);
    parts_["fusion"].step = stack(s_.fusion_blocks, length, remembered, false);
    parts_["velocity"].step = stack(s_.velocity_blocks, length, remembered, true);
    parts_["open"].step.products = c_ * (c_ + 1);
    if (s_.grounded)
      parts_["grounding"].step.products = grounding(region + image_ + history_length, region);
    else
      parts_["plain_velocity"].step.products = c_ * (c_ + pose_values);
  }

  /// Number of tokens that come out of it.
  Count count_point_encoder() {
    if (!s_.point_encoder) return points_;
    Work& work = parts_[s_.point_groups > 0 ? "point_groups" : "point_encoder"].step;
    if (s_.point_groups == 0) {
      work = stack(s_.point_blocks, points_, 0, false);
      return points_;
    }
    const Count groups = s_.point_groups, members = groups * s_.group_size, square = c_ * c_;
    work = stack(s_.point_blocks, 2 * groups, 0, false);
    work.products += (points_ + members + 3 * groups) * square + (members + groups) * 3 * c_;
    return 2 * groups;
  }

  /// Which word each head looks for, and what that makes of the image tokens' colours.
  Count seeking() const {
    const Count keys = s_.heads * key_size;
    return (words_ + 1) * c_ * keys + words_ * keys + s_.heads * words_ * image_;
  }

  /// grounding.h with `points` to choose from, `region` of which differ from step to step.
  Count grounding(Count points, Count region) const {
    const Count heads = s_.heads, keys = heads * key_size, basis = 3 + directions_per_head * heads;
    const Count layers = 2 * c_ * keys + c_ * c_ + c_ * (heads + 3 * basis + 9);
    const Count scores = points * c_ * heads + heads * words_ * region;
    const Count means = heads * points * (3 + 3 + 4 + 1) + heads * 3;
    return layers + scores + means + 3 * basis * 3;
  }

  static constexpr Count key_size = 16, directions_per_head = 12;

  const NetworkShape s_;
  const Block block_;
  const Count c_, words_, image_, points_;
  std::map<std::string, PartWork> parts_;
};

}  // namespace

Work& Work::operator+=(const Work& other) {
  products += other.products;
  recurrences += other.recurrences;
  return *this;
}

std::map<std::string, PartWork> cost_of(const NetworkShape& shape, const std::string& backbone) {
  return Costs(shape, backbone).all();
}

}  // namespace flowscope
