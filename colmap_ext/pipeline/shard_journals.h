// stereo/phimvs.shards/: a journal for each process that does a shard, written by that process alone. So shards on many
// computers need no lock; whoever runs next reads them all, and a run without shards takes them over into phimvs.json.
//
// A journal is text, a JSON object a line: first what the process is, then a task each as in phimvs.json.journal, last
// {"ended":true}. One without that last line may still be written, or was killed.
//
// Generations put journals in order without clocks: a process is of a later one than all that it finds when it starts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/task_record.h"

namespace colmap_ext {

// The first line of a journal.
struct ShardProcess {
  std::string shard = {};       // "3/8", from 0
  std::string only_stage = {};  // empty: all
  std::string options_hash = {};
  int generation = 0;
  int num_workers = 1;                   // images at once
  int num_images = 0;                    // of the whole workspace
  std::vector<std::string> stages = {};  // all kinds of results, in their order
  bool has_ended = false;
};

struct ShardLine {
  RecordedTask task;
  TaskRecord record;
  int generation = 0;
};

class ShardJournals {
 public:
  explicit ShardJournals(const std::filesystem::path& stereo_folder);

  // What other processes have added since the last call, in the order of their generations.
  std::vector<ShardLine> ReadNew();
  // Of all journals that were read, by name.
  std::vector<ShardProcess> Processes() const;
  // Whether an earlier process of the same shard has left a journal without its end.
  bool HasUnended(const ShardProcess& process) const;
  // Removes those that ended, and those of killed processes whose shard a later one has done. Call when what was read of them
  // is safe elsewhere.
  void RemoveEnded();

  // This process's own: made with its first line, under a name that no other has. Throws phi::ResourceError.
  void Open(const ShardProcess& process);
  bool IsOpen() const { return !own_.empty(); }
  void Append(const std::string& line) const;

 private:
  struct Journal {
    ShardProcess process;
    std::uint64_t num_bytes_read = 0;
  };
  bool IsOver(const ShardProcess& process) const;
  void ReadJournal(const std::filesystem::path& path, std::vector<ShardLine>* lines);

  const std::filesystem::path folder_;
  std::filesystem::path own_;  // empty: none
  std::map<std::filesystem::path, Journal> journals_;
};

}  // namespace colmap_ext
