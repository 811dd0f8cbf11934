#include "policy/fused_groups.h"

#include <ATen/Parallel.h>

#include <algorithm>

#include "policy/flush_denormals.h"
#include "policy/packed_layer.h"

namespace flowscope {
namespace {

constexpr std::int64_t kRows = 128, kGroups = 8;  // at a time

}  // namespace

torch::Tensor fused_groups(const GroupWeights& w, const torch::Tensor& tokens, const torch::Tensor& relative,
                           const torch::Tensor& neighbour, const MambaKernels& kernels,
                           const TokenKernels& token_kernels) {
  const std::int64_t batch = relative.size(0), groups = relative.size(1), size = relative.size(2),
                     channels = tokens.size(2), points = tokens.size(0) * tokens.size(1);
  const PackedLayer token_in(kernels, w.token_in, w.token_in_bias), inner(kernels, w.inner, w.inner_bias),
      pooled(kernels, w.pooled), out(kernels, w.out, w.out_bias);
  const torch::Tensor place = w.place_in.t().contiguous(), from = tokens.contiguous(),
                      where = relative.contiguous(), entered = torch::empty({points, channels}),
                      result = torch::empty({batch, groups, channels});
  const float* const token = from.data_ptr<float>();
  float *const h_of_token = entered.data_ptr<float>(), *const to = result.data_ptr<float>();

  at::parallel_for(0, points, kRows, [&](std::int64_t first, std::int64_t last) {
    token_in.apply(last - first, {token + first * channels, channels}, h_of_token + first * channels);
  });
  at::parallel_for(0, batch * groups, kGroups, [&](std::int64_t begin, std::int64_t end) {
    const FlushDenormals flush;
    AlignedFloats h, u, top, above;
    h.reserve(kGroups * size * channels), u.reserve(kGroups * size * channels);
    top.reserve(kGroups * channels), above.reserve(kGroups * channels);
    for (std::int64_t first = begin; first < end; first += kGroups) {
      const std::int64_t count = std::min(kGroups, end - first), rows = count * size;
      const GroupShape shape{count, size, channels};
      token_kernels.members({shape,
                             {h_of_token, channels},
                             neighbour.data_ptr<std::int64_t>() + first * size,
                             where.data_ptr<float>() + 3 * first * size,
                             place.data_ptr<float>(),
                             h.data(),
                             top.data()});
      pooled.apply(count, {top.data(), channels}, above.data());
      inner.apply(rows, {h.data(), channels}, u.data());
      token_kernels.pooled({shape, u.data(), above.data(), top.data()});
      out.apply(count, {top.data(), channels}, to + first * channels);
    }
  });
  return result;
}

}  // namespace flowscope
