// stereo/phimvs.json: what made the maps of a workspace, so that an interrupted run goes on where it stopped
// and maps of other programs are recognised.
//
// The file is rewritten at the start of each stage; in between, finished tasks are appended as one line each
// to phimvs.json.journal, which costs the same for the last of 10,000 images as for the first.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/pipeline/file_identity.h"

namespace colmap_ext {

struct TaskRecord {
  std::string
      state;  // "pending": its files may be missing or old; "done": they are, or were about to be, there; "failed"
  std::string key;  // hash of the options and the inputs that the result depends on
  double seconds = 0;
  std::int64_t peak_memory_bytes = 0;      // of the process, when the task ended
  std::vector<std::string> warnings;       // for a failed task, why
  std::vector<FileIdentity> files = {};    // of the result; none where an earlier program made it
  std::vector<FileIdentity> earlier = {};  // of earlier results that may still lie under its names
  std::string options_hash = {};  // of the last run that made it or found it up to date; empty: not known
};

// Thread-safe after Open.
class RunRecord {
 public:
  using Task = std::pair<std::string, std::string>;  // (image name, kind of result)

  // Reads what is there. A damaged phimvs.json throws phi::InputError that says how to go on.
  explicit RunRecord(const std::filesystem::path& stereo_folder);

  // Null when this workspace's record does not know the result: then a file that is there is not ours.
  const TaskRecord* Find(const std::string& image, const std::string& kind) const;

  // The run that is about to write: its options and their hash.
  void SetOptions(const std::map<std::string, std::string>& effective, const std::string& hash);
  // Marks results as about to be written; in the file when this returns, before any of their files changes.
  void Begin(const std::vector<Task>& tasks, const std::vector<std::string>& keys);
  // Notes a result whose files are complete, before they get their names: what a run finds under these names is either in
  // the record or not ours, wherever the last one was killed. In the journal when this returns; on the disk when the files
  // are (MapStore).
  void Finish(const Task& task, const TaskRecord& record);
  void Forget(const Task& task);
  // The run that is under way found the result up to date.
  void Confirm(const Task& task);
  // Of the last run of patch_match_stereo; empty: there was none.
  const std::string& options_hash() const { return options_hash_; }
  // A run that has ended, as SummaryJson writes it; the last 20 are kept. On disk with the next Compact.
  void AddRun(const std::string& summary_json);
  // Rewrites phimvs.json and removes the journal; nothing when neither tasks nor the hash of options have changed, so that
  // a finished workspace may be read-only. For the end of a run, when all files of finished tasks have their names.
  void Compact();

 private:
  void ReadFile();
  void ReplayJournal();
  void CompactLocked();

  const std::filesystem::path path_, journal_path_;
  mutable std::mutex mutex_;
  std::map<Task, TaskRecord> tasks_;
  std::map<std::string, std::string> options_;
  std::string options_hash_;
  std::deque<std::string> runs_;  // JSON objects, oldest first
  bool changed_ = false;          // since phimvs.json was read or written
};

}  // namespace colmap_ext
