// Numbers below the smallest normal float count as zero while this lives: decayed states reach them, and they
// are slow.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace flowscope {

/// Of this thread only; the former setting returns with the end of the scope.
class FlushDenormals {
 public:
#if defined(__x86_64__)
  FlushDenormals() : former_(_mm_getcsr()) { _mm_setcsr(former_ | kFlushToZero | kDenormalsAreZero); }
  ~FlushDenormals() { _mm_setcsr(former_); }
#else
  FlushDenormals() {}
#endif
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

#if defined(__x86_64__)
 private:
  static constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  unsigned former_;
#endif
};

}  // namespace flowscope
