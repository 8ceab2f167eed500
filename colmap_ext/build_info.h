// What this program was built from, and for which GPUs.
#pragma once

#include <string>

namespace colmap_ext {

const char* BuildCommit();        // seven digits, or "unknown"
const char* CudaArchitectures();  // as CMake names them, "75-real, 90"; empty without the CUDA backend

// Version, commit, CUDA architectures, and the devices of this machine that work: one line each.
std::string VersionText();

}  // namespace colmap_ext
