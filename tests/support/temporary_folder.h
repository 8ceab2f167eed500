// A folder of its own for a test, removed at its end.
#pragma once

#include <filesystem>
#include <string>

namespace test_support {

class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

std::string ReadBytes(const std::filesystem::path& path);
// Creates missing folders.
void WriteBytes(const std::filesystem::path& path, const std::string& bytes);

}  // namespace test_support
