// Flushes denormal numbers to zero on this thread during the lifetime of the object: decaying Adam
// moments would otherwise cost a microcode assist each.
#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace color3d {

class ScopedFlushToZero {
 public:
#if defined(__SSE__)
  ScopedFlushToZero() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }
  ~ScopedFlushToZero() { _mm_setcsr(saved_); }

 private:
  unsigned saved_;
#else
  ScopedFlushToZero() {}
#endif
};

}  // namespace color3d
