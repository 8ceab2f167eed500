#include "tests/support/test_data.h"

#include <cstdlib>

namespace test_support {

std::filesystem::path FindScene(const char* name) {
  const char* root = std::getenv("PHIMVS_TEST_DATA");
  const std::filesystem::path scene =
      (root ? std::filesystem::path(root)
            : std::filesystem::path(PHIMVS_SOURCE_DIR).parent_path() / "shared/data") /
      name;
  return std::filesystem::is_directory(scene) ? scene : std::filesystem::path();
}

}  // namespace test_support
