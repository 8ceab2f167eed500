// One libFuzzer program for all readers: PHIMVS_FUZZ_TARGET names the one to run. With PHIMVS_FUZZ_SEEDS it writes the seeds
// into that folder first.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "phi/base/log.h"
#include "tests/fuzz/targets.h"

namespace {

const fuzz::Target* g_target = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* name = std::getenv("PHIMVS_FUZZ_TARGET");
  g_target = fuzz::FindTarget(name != nullptr ? name : "");
  if (g_target == nullptr) {
    std::fprintf(stderr, "PHIMVS_FUZZ_TARGET must be one of:");
    for (const fuzz::Target& target : fuzz::Targets()) std::fprintf(stderr, " %s", target.name);
    std::fprintf(stderr, "\n");
    std::exit(1);
  }
  phi::SetLogSink([](phi::LogLevel, const std::string&) {});
  if (const char* folder = std::getenv("PHIMVS_FUZZ_SEEDS")) {
    std::filesystem::create_directories(folder);
    int number = 0;
    for (const std::string& seed : g_target->seeds()) {
      std::ofstream(std::filesystem::path(folder) / ("seed" + std::to_string(number++)), std::ios::binary)
          << seed;
    }
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  g_target->run({data, size});
  return 0;
}
