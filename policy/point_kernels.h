// The inner loops of farthest point sampling on plain arrays, once per instruction set. No torch here.
#pragma once

#include <vector>

namespace flowscope {

/// Every bucket begins at a multiple of this many slots, so that no vector reaches over its end.
inline constexpr int kPointLanes = 16;

/// Points in buckets of neighbours, as separate arrays over slots. Squared distances are salience * (place² +
/// tint_weight * tint²); every instruction set gives the same numbers.
struct BucketArrays {
  int buckets = 0;                  ///< a multiple of kPointLanes, the last ones empty
  const int* first = nullptr;       ///< [buckets + 1] first slot of each
  const float* place[3] = {};       ///< [slots] metres
  const float* tint[3] = {};        ///< [slots] colour; null: place alone counts and salience is 1
  const float* salience = nullptr;  ///< [slots] >= 0; null without tint
  const float *place_low[3] = {}, *place_high[3] = {};  ///< [buckets] bounding boxes
  const float *tint_low[3] = {}, *tint_high[3] = {};    ///< [buckets] or null
  const float* least_salience = nullptr;                ///< [buckets] or null
  float tint_weight = 0;
  float* distance2 = nullptr;  ///< [slots] to the nearest point chosen; -1: padding, or chosen itself
  float* farthest2 = nullptr;  ///< [buckets] greatest distance2 of each
};

struct PointKernels {
  const char* name;
  /// Lowers every distance2 to that from `sample` (place, then tint) and brings farthest2 up to date. Buckets
  /// that lie farther away than their own farthest2 are not touched.
  void (*lower)(const BucketArrays&, const float* sample);
  /// Slot of the greatest distance2, of equal ones that with the lowest `rank` [slots]; -1: none is left.
  int (*farthest)(const BucketArrays&, const int* rank);
};

extern const PointKernels kPortablePointKernels, kAvx2PointKernels, kAvx512PointKernels;

/// Those that this machine can run, fastest first; never empty.
const std::vector<const PointKernels*>& supported_point_kernels();

}  // namespace flowscope
