#include "colmap_ext/folder_files.h"

#include <sys/stat.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "phi/base/log.h"
#include "phi/base/message.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

class FolderWalk {
 public:
  FolderWalk(const fs::path& folder, HiddenFiles hidden) : folder_(folder), hidden_(hidden) {}

  std::vector<fs::path> Files() {
    Enter({});
    std::sort(files_.begin(), files_.end());
    return std::move(files_);
  }

 private:
  using FolderId = std::pair<dev_t, ino_t>;  // whatever name leads to it

  // `below`: from folder_.
  void Enter(const fs::path& below) {
    struct stat status = {};
    if (::stat((folder_ / below).c_str(), &status) != 0) return;
    const FolderId id(status.st_dev, status.st_ino);
    if (std::find(enclosing_.begin(), enclosing_.end(), id) != enclosing_.end()) return;
    enclosing_.push_back(id);
    std::error_code error;
    for (fs::directory_iterator entry(folder_ / below, error), end; !error && entry != end;
         entry.increment(error)) {
      Add(*entry, below / entry->path().filename());
    }
    if (error) {
      phi::LogWarning(phi::AboutFile(folder_ / below) +
                      ": this folder is left out, since it cannot be read: " + error.message());
    }
    enclosing_.pop_back();
  }

  void Add(const fs::directory_entry& entry, const fs::path& file) {
    if (hidden_ == HiddenFiles::kLeftOut && file.filename().native().starts_with('.')) return;
    std::error_code unreachable;
    if (entry.is_directory(unreachable)) {
      Enter(file);
    } else if (entry.is_regular_file(unreachable)) {
      files_.push_back(file);
    }
  }

  const fs::path& folder_;
  const HiddenFiles hidden_;
  std::vector<FolderId> enclosing_;  // those that the walk is in
  std::vector<fs::path> files_;
};

}  // namespace

std::vector<fs::path> FilesBelow(const fs::path& folder, HiddenFiles hidden) {
  return FolderWalk(folder, hidden).Files();
}

}  // namespace colmap_ext
