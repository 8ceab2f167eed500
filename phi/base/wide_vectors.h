// For functions whose loops the compiler turns into vector instructions: compiled for any processor, for one that has AVX2, and, by
// compilers that can tell one, for one that has AVX-512; chosen when the program starts. All give the same bits: nothing is fused or
// reordered (-ffp-contract=off). Builds with sanitizers have the first form alone, since what chooses runs before their runtime is set up.
#pragma once

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if __GNUC__ >= 12
#define PHI_WIDE_VECTORS __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define PHI_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#endif
#else
#define PHI_WIDE_VECTORS
#endif
