// The instruction sets that vector code is not compiled for; to be read before hwy/foreach_target.h. SSSE3 and AVX3_DL gain nothing over
// SSE4 and AVX3 here; vectors without a fixed length cannot be array elements.
#pragma once

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
