// The files of a result: their names, and whose those are that lie there.
#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
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

// Removes what fusion wrote of maps of this kind: of all images, since a confidence map rests on the maps of its image's neighbours
// too. For who replaces or removes such a map, before he does.
void RemoveConfidenceMaps(const Workspace& workspace, std::string_view kind);

// The same for who replaces many: each kind's once, since to look through them for each image would take the square of their number.
class ConfidenceRemoval {
 public:
  explicit ConfidenceRemoval(const Workspace& workspace) : workspace_(workspace) {}
  // When it returns they are gone, whichever thread removed them.
  void Remove(const std::string& kind);

 private:
  const Workspace& workspace_;
  std::mutex mutex_;
  std::set<std::string> removed_;
};

}  // namespace colmap_ext
