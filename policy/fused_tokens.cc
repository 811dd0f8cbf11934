#include "policy/fused_tokens.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "policy/flush_denormals.h"
#include "policy/packed_layer.h"

namespace flowscope {
namespace {

constexpr std::int64_t kRows = 128;  // at a time

/// The words of one scene, ready to be multiplied with.
struct SceneWords {
  SceneWords(const TokenWeights& w, const WordKeys& keys, std::int64_t scene, const MambaKernels& kernels)
      : sharp(kernels, keys.sharp[scene].t()),
        wide(kernels, keys.wide[scene].t()),
        value(kernels, keys.value[scene].t()),
        // key · (Q g + b): the queries of all points are never built.
        score(kernels, keys.key[scene].mm(w.query)),
        scale(1.f / std::sqrt(static_cast<float>(keys.key.size(2)))),
        bias((keys.key[scene].mv(w.query_bias) * scale).contiguous()),
        planes(torch::cat(
                   {keys.color[scene].t(), keys.hue[scene].t(), keys.is_color[scene], keys.is_word[scene]})
                   .contiguous()) {
    const std::int64_t count = planes.size(1);
    colors.words = count;
    for (int k = 0; k < 3; ++k) colors.color[k] = plane(k), colors.hue[k] = plane(3 + k);
    colors.is_color = plane(6);
    colors.sharp = w.sharp, colors.wide = w.wide, colors.farthest2 = w.farthest2;
    colors.color_strictness = w.color_strictness, colors.hue_strictness = w.hue_strictness;
  }
  const float* plane(int row) const { return planes.data_ptr<float>() + row * planes.size(1); }
  const float* is_word() const { return plane(7); }

  PackedLayer sharp, wide, value, score;
  float scale;
  torch::Tensor bias, planes;  ///< [W], [8, W]
  ColorWords colors;
};

/// One thread's memory for kRows points.
struct Scratch {
  Scratch(std::int64_t channels, std::int64_t words) {
    for (AlignedFloats* wide : {&h, &g}) wide->reserve(kRows * channels);
    for (AlignedFloats* narrow : {&near, &alike}) narrow->reserve(kRows * words);
  }
  AlignedFloats h, g, near, alike;
};

}  // namespace

BoundTokens fused_tokens(const TokenWeights& w, const torch::Tensor& features, const torch::Tensor& color,
                         const WordKeys& keys, const torch::Tensor& extra, const MambaKernels& kernels,
                         const TokenKernels& tk) {
  const std::int64_t scenes = features.size(0), points = features.size(1), width = features.size(2),
                     channels = w.in.size(0), words = keys.is_word.size(2);
  const PackedLayer in(kernels, w.in, w.in_bias), first_out(kernels, w.first_out, w.first_bias),
      second_out(kernels, w.second_out, w.second_bias);
  const torch::Tensor x = features.contiguous(), rgb = color.contiguous(),
                      added = extra.defined() ? extra.contiguous() : extra;
  const BoundTokens result{
      torch::empty({scenes, points, channels}),
      keys.key.defined() ? torch::empty({scenes, points, words}) : torch::zeros({scenes, points, words})};

  for (std::int64_t scene = 0; scene < scenes; ++scene) {
    std::optional<SceneWords> bound;
    if (keys.key.defined()) bound.emplace(w, keys, scene, kernels);
    at::parallel_for(0, (points + kRows - 1) / kRows, 1, [&](std::int64_t begin, std::int64_t end) {
      const FlushDenormals flush;  // words that match nothing weigh next to nothing
      Scratch s(channels, words);
      for (std::int64_t chunk = begin; chunk < end; ++chunk) {
        const std::int64_t row = scene * points + chunk * kRows,
                           rows = std::min(kRows, points - chunk * kRows);
        float *const h = s.h.data(), *const g = s.g.data(), *const scores = s.near.data();
        in.apply(rows, {x.data_ptr<float>() + row * width, width}, h);
        if (added.defined()) {
          const float* more = added.data_ptr<float>() + row * channels;
          for (std::int64_t i = 0; i < rows * channels; ++i) h[i] += more[i];
        }
        if (bound) {
          tk.likeness({bound->colors, rows, rgb.data_ptr<float>() + 3 * row, s.near.data(), s.alike.data(),
                       result.mismatch.data_ptr<float>() + row * words});
          bound->sharp.apply(rows, {s.near.data(), words}, h, true);
          bound->wide.apply(rows, {s.alike.data(), words}, h, true);
          std::copy_n(h, rows * channels, g);
          tk.gelu(g, rows * channels);
          bound->score.apply(rows, {g, channels}, scores);
          tk.attend(scores, rows, words, bound->scale, bound->bias.data_ptr<float>(), bound->is_word());
          bound->value.apply(rows, {scores, words}, h, true);
        }
        tk.gelu(h, rows * channels);
        first_out.apply(rows, {h, channels}, g);
        tk.gelu(g, rows * channels);
        second_out.apply(rows, {g, channels}, result.token.data_ptr<float>() + row * channels);
      }
    });
  }
  return result;
}

}  // namespace flowscope
