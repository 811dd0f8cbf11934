// All kernels of a Mamba block at one vector width. Included once per instruction set, by
// policy/mamba_kernels_*.cc.
#pragma once

#include "policy/conv_kernel_body.h"
#include "policy/mamba_kernels.h"
#include "policy/norm_kernel_body.h"
#include "policy/product_kernel_body.h"
#include "policy/scan_kernel_body.h"

namespace flowscope {

template <int W>
constexpr MambaKernels mamba_kernels_of_width(const char* name) {
  return {.name = name,
          .width = W,
          .scan_forward = scan_forward<W>,
          .scan_backward = scan_backward<W>,
          .conv_forward = conv_forward<W>,
          .conv_backward = conv_backward<W>,
          .pack = pack_weight<W>,
          .multiply = multiply<W>,
          .layer_norm = layer_norm<W>,
          .softplus = softplus<W>};
}

}  // namespace flowscope
