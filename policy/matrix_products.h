// The matrix products of a piece of work, recorded and run again alone: the least that the work could cost.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace flowscope {

/// One call of aten::mm, addmm, bmm or baddbmm: sizes and strides of its two factors, two or three
/// dimensions.
struct MatrixProduct {
  std::vector<std::int64_t> left_size, left_stride, right_size, right_stride;
  std::int64_t multiply_adds() const;
};

/// What `work` multiplies on this thread (and in the backward passes that it waits for), in order.
std::vector<MatrixProduct> record_products(const std::function<void()>& work);

/// Fastest of `repeats` runs of these products, milliseconds: the same operators with the same layouts into
/// memory that is there already. One after the other, each by all of torch's threads; or with `shares` above
/// 0, as many threads that each take an equal number of them in their order.
double products_ms(const std::vector<MatrixProduct>& products, int repeats, int shares = 0);

}  // namespace flowscope
