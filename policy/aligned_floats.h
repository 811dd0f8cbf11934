// Scratch memory for vectorised loops.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

namespace flowscope {

/// Floats that begin on a cache line; what they hold is lost when they grow. Not shared between threads.
class AlignedFloats {
 public:
  /// At least `count` floats from here on; never shrinks, so that a steady size never allocates.
  void reserve(std::int64_t count) {
    if (count <= count_) return;
    data_.reset(new (kLine) float[static_cast<std::size_t>(count)]);
    count_ = count;
  }
  float* data() { return data_.get(); }
  const float* data() const { return data_.get(); }

 private:
  static constexpr std::align_val_t kLine{64};
  struct Free {
    void operator()(float* data) const { ::operator delete[](data, kLine); }
  };
  std::unique_ptr<float[], Free> data_;
  std::int64_t count_ = 0;
};

}  // namespace flowscope
