// The real scenes that some tests want: folder PHIMVS_TEST_DATA, or ../shared/data beside the source.
#pragma once

#include <filesystem>

namespace test_support {

// Empty when the scene is not there; such tests skip.
std::filesystem::path FindScene(const char* name);

}  // namespace test_support
