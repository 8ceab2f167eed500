// PHI_HD marks a function that both the CPU compiler and nvcc build: what happens at a pixel is written once.
#pragma once

#if defined(__CUDACC__)
#define PHI_HD __host__ __device__ __forceinline__
#else
#define PHI_HD inline
#endif
