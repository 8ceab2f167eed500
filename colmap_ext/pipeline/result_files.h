// The files of a result: their names, and whose those are that lie there.
#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/task_record.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Every name that a file of a result may have, whatever its form and whether it has a mask or costs.
std::vector<std::filesystem::path> ResultPaths(const Workspace& workspace, int image,
                                               const std::string& kind);

// What a file under such a name is to who makes the result.
enum class FileState {
  kMissing,
  kCurrent,  // of the result, as the record knows it
  kOurs,     // of an earlier result, or damaged: to be replaced
  kForeign,  // another program's
};

// A file is ours that the record identifies, or where the record knows the result and the file is damaged: no whole map or
// mask, or a map without a single value. record: null where nothing is known of the result.
FileState StateOf(const std::filesystem::path& path, const TaskRecord* record);

// Removes confidence maps for who replaces or removes the maps that fusion wrote them of, before he does.
class ConfidenceRemoval {
 public:
  explicit ConfidenceRemoval(const Workspace& workspace) : workspace_(workspace) {}
  // Those of a kind, of all images, since they rest on the maps of their images' neighbours too. Each kind's once: to look through them
  // for each image would take the square of their number. When it returns they are gone, whichever thread removed them.
  void Remove(const std::string& kind);

 private:
  const Workspace& workspace_;
  std::mutex mutex_;
  std::set<std::string> removed_;
};

}  // namespace colmap_ext
