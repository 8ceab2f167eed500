#include "tests/support/run_on_workspace.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace test_support {

namespace fs = std::filesystem;

ProgramResult RunOnWorkspace(const std::string& command, const fs::path& workspace,
                             const std::vector<std::string>& options) {
  std::vector<std::string> words{PHIMVS_BINARY,         command, "--workspace_path", workspace.string(),
                                 "--PhiStereo.backend", "cpu"};
  words.insert(words.end(), options.begin(), options.end());
  return RunProgram(words);
}

void MakeRoom(const fs::path& folder, int width, int height, int num_views) {
  const ProgramResult made =
      RunProgram({PHIMVS_BINARY, "make_scene", "--output_path", folder / "room", "--width", std::to_string(width),
                  "--height", std::to_string(height), "--num_views", std::to_string(num_views), "--jpeg_quality", "0"});
  EXPECT_EQ(made.exit_code, 0) << made.errors;
}

std::map<std::string, std::string> ReadMaps(const fs::path& workspace) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(workspace / "stereo")) {
    const std::string extension = entry.path().extension();
    if (!entry.is_regular_file() || (extension != ".bin" && extension != ".png" && extension != ".map")) continue;
    files[fs::relative(entry.path(), workspace)] = ReadBytes(entry.path());
  }
  return files;
}

}  // namespace test_support
