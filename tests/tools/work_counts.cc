// work_counts WIDTH HEIGHT VIEWS
//
// What one estimation on the CPU costs, in numbers that are the same on every machine: the first view of a synthetic room from all the
// others, on one thread. Prints "NAME COUNT" lines; bytes are the most that the heap held at once beyond the images. valgrind
// counts its instructions (tests/phi/work_counts_test.cc).
#include <malloc.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "colmap_ext/synthetic/room.h"
#include "phi/backend.h"
#include "phi/base/image_noise.h"

namespace {

std::atomic<std::int64_t> heap_bytes{0}, peak_bytes{0};

void Note(std::int64_t bytes) {
  const std::int64_t now = heap_bytes += bytes;
  if (now > peak_bytes) peak_bytes = now;  // one thread estimates
}

}  // namespace

// Sanitizers bring their own heap; bytes are 0 there.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t size);
void __libc_free(void* memory);

void* malloc(std::size_t size) {
  void* memory = __libc_malloc(size);
  Note(static_cast<std::int64_t>(malloc_usable_size(memory)));
  return memory;
}

void free(void* memory) {
  Note(-static_cast<std::int64_t>(malloc_usable_size(memory)));
  __libc_free(memory);
}
}
#endif

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "see the head of tests/tools/work_counts.cc\n");
    return 1;
  }
  const colmap_ext::SyntheticRoom room = colmap_ext::MakeSyntheticRoom({.width = std::atoi(argv[1]),
                                                                       .height = std::atoi(argv[2]),
                                                                       .num_views = std::atoi(argv[3]),
                                                                       .jpeg_quality = 0,
                                                                       .supersampling = 1});
  phi::EstimationInput input;
  input.reference = room.scene.Image(0);
  input.sources = room.scene.SourceImages(0);
  input.noise = phi::NoiseDeviation(input.reference.image->view());
  input.depth_min = 1;
  input.depth_max = 10;
  const auto backend = phi::MakeCpuBackend(1);
  const std::int64_t before = heap_bytes;
  peak_bytes = before;
  const phi::EstimationCounts counts = backend->Estimate(input, {}).counts;
  std::printf("hypotheses %lld\nwindows %lld\nsamples %lld\nbytes %lld\n", static_cast<long long>(counts.hypotheses),
              static_cast<long long>(counts.windows), static_cast<long long>(counts.samples),
              static_cast<long long>(peak_bytes - before));
  return 0;
}
