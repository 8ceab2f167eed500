// A machine's proc/ and sys/ in a folder, as far as they tell of control groups.
#pragma once

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace test_support {

class ControlGroupFiles {
 public:
  const std::filesystem::path& root() const { return root_.path(); }

  // Of this process: the lines of /proc/self/cgroup.
  void SetGroups(const std::string& lines) { WriteBytes(root_ / "proc/self/cgroup", lines); }
  // A file below /sys/fs/cgroup of that line.
  void Set(const std::string& file, const std::string& line) { WriteBytes(root_ / "sys/fs/cgroup" / file, line + "\n"); }

 private:
  TemporaryFolder root_;
};

}  // namespace test_support
