#include "colmap_ext/pipeline/run_record.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <system_error>
#include <utility>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/json_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using Json = nlohmann::ordered_json;

bool Contains(const std::vector<FileIdentity>& identities, const FileIdentity& identity) {
  return std::any_of(identities.begin(), identities.end(),
                     [&](const FileIdentity& other) { return other.Text() == identity.Text(); });
}

void AddIdentities(const std::vector<FileIdentity>& files, std::vector<FileIdentity>* known) {
  for (const FileIdentity& file : files) {
    if (!Contains(*known, file)) known->push_back(file);
  }
}

}  // namespace

RunRecord::RunRecord(const std::filesystem::path& stereo_folder)
    : path_(stereo_folder / "phimvs.json"),
      journal_path_(stereo_folder / "phimvs.json.journal"),
      shards_(stereo_folder) {
  ReadFile();
  ReplayJournal();
  Refresh();
}

void RunRecord::ReadFile() {
  if (!std::filesystem::exists(path_)) return;
  try {
    std::ifstream file = OpenRegularFile(path_);
    const Json json = ParseJson(file);
    options_hash_ = json.at("options_hash").get<std::string>();
    generation_ = json.value("generation", 0);
    options_ = json.at("options").get<std::map<std::string, std::string>>();
    if (json.contains("runs")) {
      for (const Json& run : json["runs"]) runs_.push_back(DumpJson(run, -1));
    }
    for (const auto& [image, kinds] : json.at("images").items()) {
      for (const auto& [kind, record] : kinds.items()) tasks_[{NameFromJson(image), kind}] = RecordFromJson(record);
    }
  } catch (const phi::ResourceError&) {
    throw;
  } catch (const std::exception& error) {  // of the parser, or of a stream that cannot be read
    throw phi::InputError(phi::AboutFile(path_) + " is damaged (" + error.what() +
                          "); remove it and run again with --overwrite true to make all maps anew");
  }
}

// A line that is no record was cut short when the process was killed or the disk was full, and the next one may have been
// appended to it: their tasks count as pending.
void RunRecord::ReplayJournal() {
  std::ifstream file = OpenRegularFile(journal_path_);
  changed_ = file.is_open();
  double task_seconds = 0;
  for (std::string line; std::getline(file, line);) {
    try {
      auto [task, record] = FromJournalLine(ParseJson(line));
      if (record.state == "done") task_seconds += record.seconds;
      TaskRecord& known = tasks_[task];
      record.earlier = known.earlier;
      known = std::move(record);
    } catch (const Json::exception&) {
      continue;
    } catch (const phi::InputError&) {
      continue;
    }
  }
  pace_ = PaceOf(task_seconds);
}

// phimvs.json was written when the tasks began, the journal's last line when the last of them was done.
double RunRecord::PaceOf(double task_seconds) const {
  std::error_code begin_unknown, end_unknown;
  const auto begin = std::filesystem::last_write_time(path_, begin_unknown);
  const auto end = std::filesystem::last_write_time(journal_path_, end_unknown);
  const std::chrono::duration<double> wall = end - begin;
  return begin_unknown || end_unknown || !(wall.count() > 0) ? 0 : task_seconds / wall.count();
}

void RunRecord::Refresh() {
  std::lock_guard<std::mutex> lock(mutex_);
  for (const ShardLine& line : shards_.ReadNew()) TakeIn(line);
  if (own_shard_) return;
  int newest = generation_;
  for (const ShardProcess& process : shards_.Processes()) {
    changed_ |= process.has_ended;  // to be taken over into phimvs.json
    if (process.generation <= newest) continue;
    newest = process.generation;
    options_hash_ = process.options_hash;
  }
}

// Files that are there under the names of a result are ours if they are of any line; done is what the latest line says.
void RunRecord::TakeIn(const ShardLine& line) {
  TaskRecord& known = tasks_[line.task];
  const auto shard = generations_.find(line.task);
  const bool is_known = !known.state.empty();
  const bool is_later = shard == generations_.end() ? line.generation > generation_ : line.generation >= shard->second;
  changed_ |= is_later;
  if (is_known && !is_later) {
    for (const FileIdentity& file : line.record.files) {
      if (!Contains(known.files, file)) AddIdentities({file}, &known.earlier);
    }
    return;
  }
  TaskRecord record = line.record;
  record.earlier = std::move(known.earlier);
  AddIdentities(known.files, &record.earlier);
  known = std::move(record);
  generations_[line.task] = line.generation;
}

void RunRecord::BeginShard(ShardProcess process) {
  std::lock_guard<std::mutex> lock(mutex_);
  process.options_hash = options_hash_;
  process.generation = generation_;
  for (const ShardProcess& other : shards_.Processes())
    process.generation = std::max(process.generation, other.generation);
  ++process.generation;
  own_shard_ = std::move(process);
}

std::vector<ShardProcess> RunRecord::ShardsSinceWholeRun() const {
  std::vector<ShardProcess> shards = shards_.Processes();
  std::erase_if(shards, [&](const ShardProcess& process) { return process.generation <= generation_; });
  return shards;
}

std::optional<TaskRecord> RunRecord::Find(const std::string& image, const std::string& kind) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto found = tasks_.find({image, kind});
  return found == tasks_.end() ? std::nullopt : std::optional(found->second);
}

bool RunRecord::Has(const Task& task, const std::string& state, const std::string& key) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto found = tasks_.find(task);
  return found != tasks_.end() && found->second.state == state && found->second.key == key;
}

std::vector<std::pair<RunRecord::Task, TaskRecord>> RunRecord::Tasks() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return {tasks_.begin(), tasks_.end()};
}

void RunRecord::SetOptions(const std::map<std::string, std::string>& effective, const std::string& hash) {
  std::lock_guard<std::mutex> lock(mutex_);
  changed_ |= hash != options_hash_;
  options_ = effective;
  options_hash_ = hash;
}

void RunRecord::Begin(const std::vector<Task>& tasks, const std::vector<std::string>& keys) {
  std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    TaskRecord record;
    record.state = "pending";
    record.key = keys[i];
    TaskRecord& known = tasks_[tasks[i]];
    record.earlier = std::move(known.earlier);
    record.earlier.insert(record.earlier.end(), known.files.begin(), known.files.end());
    known = std::move(record);
    generations_.erase(tasks[i]);
  }
  if (!own_shard_) return CompactLocked();
  if (!tasks.empty() && !shards_.IsOpen()) shards_.Open(*own_shard_);
}

void RunRecord::Finish(const Task& task, const TaskRecord& record) {
  std::lock_guard<std::mutex> lock(mutex_);
  TaskRecord finished = record;
  finished.options_hash = options_hash_;
  changed_ = true;
  const std::string line = JournalLine(task, finished);
  if (own_shard_) {
    shards_.Append(line);
    generations_[task] = own_shard_->generation;
  } else {
    AppendLine(journal_path_, line);
  }
  TaskRecord& known = tasks_[task];
  finished.earlier = std::move(known.earlier);
  known = std::move(finished);
}

void RunRecord::FailAll(const std::vector<Task>& tasks, const std::vector<std::string>& why) {
  if (tasks.empty()) return;
  Begin(tasks, std::vector<std::string>(tasks.size()));
  for (std::size_t i = 0; i < tasks.size(); ++i) Finish(tasks[i], {.state = "failed", .key = "", .warnings = {why[i]}});
}

void RunRecord::Forget(const Task& task) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (tasks_.erase(task) > 0) changed_ = true;
}

void RunRecord::Confirm(const Task& task) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto found = tasks_.find(task);
  if (found == tasks_.end() || found->second.options_hash == options_hash_) return;
  found->second.options_hash = options_hash_;
  changed_ = true;
}

void RunRecord::AddRun(const std::string& summary_json) {
  constexpr std::size_t kMaxRuns = 20;
  std::lock_guard<std::mutex> lock(mutex_);
  changed_ = true;
  runs_.push_back(summary_json);
  if (runs_.size() > kMaxRuns) runs_.pop_front();
}

void RunRecord::Compact() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (own_shard_) return EndShard();
  if (!changed_) return;
  for (auto& [task, record] : tasks_) {
    if (record.state == "done") record.earlier.clear();
  }
  CompactLocked();
}

void RunRecord::EndShard() {
  // One that was killed after its last image leaves its successor nothing to do; its journal would stay.
  if (!shards_.IsOpen() && shards_.HasUnended(*own_shard_)) shards_.Open(*own_shard_);
  if (shards_.IsOpen()) shards_.Append("{\"ended\":true}\n");
}

void RunRecord::CompactLocked() {
  Json images = Json::object(), runs = Json::array();
  for (const std::string& run : runs_) runs.push_back(ParseJson(run));
  // Added at the end, since this kind of object would look through all others for the name. Tasks are in the images' order.
  auto& entries = images.get_ref<Json::object_t&>();
  const std::string* image = nullptr;
  for (const auto& [task, record] : tasks_) {
    if (image == nullptr || *image != task.first) entries.emplace_back(NameToJson(task.first), Json::object());
    image = &task.first;
    entries.back().second[task.second] = RecordToJson(record);
  }
  for (const ShardProcess& process : shards_.Processes()) generation_ = std::max(generation_, process.generation);
  const Json json = {{"version", PHIMVS_VERSION},
                     {"generation", generation_},
                     {"options", options_},
                     {"options_hash", options_hash_},
                     {"runs", runs},
                     {"images", images}};
  AtomicFile file(path_);  // an empty record after a power cut would cost all maps
  file.Write(DumpJson(json, 1) + "\n");
  file.Publish();
  std::filesystem::remove(journal_path_);
  generations_.clear();
  SyncFolder(path_.parent_path());
  shards_.RemoveEnded();
  changed_ = false;
}

}  // namespace colmap_ext
