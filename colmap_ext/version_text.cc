#include <string_view>

#include "colmap_ext/build_info.h"
#include "colmap_ext/pipeline/backend_choice.h"
#include "phi/base/error.h"

namespace colmap_ext {

std::string VersionText() {
  const std::string_view architectures = CudaArchitectures();
  std::string text = "phimvs " PHIMVS_VERSION "\ncommit " + std::string(BuildCommit()) + "\nCUDA architectures: " +
                     (architectures.empty() ? "none" : std::string(architectures)) + "\n";
  for (const BackendKind kind : {BackendKind::kCuda, BackendKind::kCpu}) {
    try {
      for (const auto& backend : MakeBackends({.kind = kind})) text += "backend " + backend->Name() + "\n";
    } catch (const phi::Error& error) {
      text += std::string("no CUDA backend: ") + error.what() + "\n";
    }
  }
  return text;
}

}  // namespace colmap_ext
