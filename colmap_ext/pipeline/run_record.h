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

namespace colmap_ext {

struct TaskRecord {
  std::string state;  // "pending": its files may be missing or old; "done"; "failed"
  std::string key;    // hash of the options and the inputs that the result depends on
  double seconds = 0;
  std::int64_t peak_memory_bytes = 0;  // of the process, when the task ended
  std::vector<std::string> warnings;   // for a failed task, why
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
  // Marks results as about to be written; on disk when this returns, before any of their files changes.
  void Begin(const std::vector<Task>& tasks, const std::vector<std::string>& keys);
  void Finish(const Task& task, const TaskRecord& record);
  void Forget(const Task& task);
  // The run that is under way found the result up to date.
  void Confirm(const Task& task);
  // Of the last run of patch_match_stereo; empty: there was none.
  const std::string& options_hash() const { return options_hash_; }
  // A run that has ended, as SummaryJson writes it; the last 20 are kept. On disk with the next Compact.
  void AddRun(const std::string& summary_json);
  // Rewrites phimvs.json and removes the journal; nothing when neither tasks nor the hash of options have changed, so that
  // a finished workspace may be read-only.
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
