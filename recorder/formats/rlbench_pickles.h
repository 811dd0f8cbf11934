// The pickles of an RLBench episode.
#pragma once

#include "recorder/bytes.h"
#include "recorder/formats/export_source.h"

namespace flowscope {

/// What low_dim_obs.pkl says of one frame.
struct RlbenchMoment {
  const Frame* frame = nullptr;
  std::vector<CameraModel> cameras;
};

/// rlbench.demo.Demo; wants rlbench (or stand-ins of its two classes) where it is loaded.
Bytes rlbench_low_dim_pickle(const Demo& demo, const std::vector<RlbenchMoment>& moments,
                             const ExportSource& source);
Bytes rlbench_variation_pickle(const Demo& demo);
Bytes rlbench_descriptions_pickle(const Demo& demo);

}  // namespace flowscope
