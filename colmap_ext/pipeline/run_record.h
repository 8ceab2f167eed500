// stereo/phimvs.json: what made the maps of a workspace, so that an interrupted run goes on where it stopped
// and maps of other programs are recognised.
//
// The file is rewritten at the start of each stage; in between, finished tasks are appended as one line each
// to phimvs.json.journal, which costs the same for the last of 10,000 images as for the first. A shard writes neither, but a
// journal of its own (shard_journals.h).
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/shard_journals.h"
#include "colmap_ext/pipeline/task_record.h"

namespace colmap_ext {

// Thread-safe after Open.
class RunRecord {
 public:
  using Task = RecordedTask;

  // Reads what is there. A damaged phimvs.json throws phi::InputError that says how to go on.
  explicit RunRecord(const std::filesystem::path& stereo_folder);

  // Empty when this workspace's record does not know the result: then a file that is there is not ours. A copy: writers may
  // finish the task meanwhile.
  std::optional<TaskRecord> Find(const std::string& image, const std::string& kind) const;
  // Whether the result is recorded in this state, "done" or "failed", for the inputs that the key stands for.
  bool Has(const Task& task, const std::string& state, const std::string& key) const;
  std::vector<std::pair<Task, TaskRecord>> Tasks() const;

  // The run that is about to write: its options and their hash.
  void SetOptions(const std::map<std::string, std::string>& effective, const std::string& hash);
  // From now on this process does a shard: what it finishes goes to its own journal, and phimvs.json stays as it is. After
  // SetOptions; of `process`, hash and generation are filled in.
  void BeginShard(ShardProcess process);
  // Takes in what other shards have finished meanwhile.
  void Refresh();
  // Of the shards whose journals are there.
  std::vector<ShardProcess> Shards() const { return shards_.Processes(); }
  // Those of them that began since a run without shards, which goes on with what all earlier ones have done, killed or not.
  std::vector<ShardProcess> ShardsSinceWholeRun() const;
  // Marks results as about to be written; in the file when this returns, before any of their files changes. (A shard needs no
  // such mark: what the record knows of their earlier files stays in it.)
  void Begin(const std::vector<Task>& tasks, const std::vector<std::string>& keys);
  // Notes a result whose files are complete, before they get their names: what a run finds under these names is either in
  // the record or not ours, wherever the last one was killed. In the journal when this returns; on the disk when the files
  // are (MapStore).
  void Finish(const Task& task, const TaskRecord& record);
  // The results of these tasks cannot be made; why: by task. Files under their names stay known as ours.
  void FailAll(const std::vector<Task>& tasks, const std::vector<std::string>& why);
  void Forget(const Task& task);
  // The run that is under way found the result up to date.
  void Confirm(const Task& task);
  // How fast a run of all images has been since it began to work, in seconds of finished tasks for each second; 0: it has finished none. By
  // the times of its two files, which one computer's clock gave.
  double Pace() const { return pace_; }
  // Of the last run of patch_match_stereo; empty: there was none.
  const std::string& options_hash() const { return options_hash_; }
  // A run that has ended, as SummaryJson writes it; the last 20 are kept. On disk with the next Compact.
  void AddRun(const std::string& summary_json);
  bool HasRuns() const { return !runs_.empty(); }
  // Rewrites phimvs.json and removes the journal; nothing when neither tasks nor the hash of options have changed, so that
  // a finished workspace may be read-only. For the end of a run, when all files of finished tasks have their names. A shard's
  // journal gets its last line.
  void Compact();

 private:
  void ReadFile();
  void ReplayJournal();
  double PaceOf(double task_seconds) const;
  void TakeIn(const ShardLine& line);
  void EndShard();
  void CompactLocked();

  const std::filesystem::path path_, journal_path_;
  mutable std::mutex mutex_;
  std::map<Task, TaskRecord> tasks_;
  std::map<Task, int> generations_;  // of what shards made; all else is of generation_
  int generation_ = 0;               // of phimvs.json: no shard that it knows was of a later one
  ShardJournals shards_;
  std::optional<ShardProcess> own_shard_;
  std::map<std::string, std::string> options_;
  std::string options_hash_;
  double pace_ = 0;
  std::deque<std::string> runs_;  // JSON objects, oldest first
  bool changed_ = false;          // since phimvs.json was read or written
};

}  // namespace colmap_ext
