// Refuses compiler settings under which doubles do not follow IEEE 754 with every operation rounded separately: the
// same stream could decode to a different mesh (docs/bitstream.md, section 1). Contraction to fused multiply-add cannot
// be detected here: CMakeLists.txt turns it off and refuses flags that turn it on.
#pragma once

#include <cfloat>
#include <limits>

#if defined(__FAST_MATH__) || defined(_M_FP_FAST)
#error "htvm must be compiled without -ffast-math (/fp:fast): decoders must agree to the bit"
#endif

namespace htvm::internal {

static_assert(std::numeric_limits<double>::is_iec559 && std::numeric_limits<double>::digits == 53);
static_assert(FLT_EVAL_METHOD == 0, "no extended precision: on 32-bit x86 compile with -msse2 -mfpmath=sse");

}  // namespace htvm::internal
