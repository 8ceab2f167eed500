#include "colmap_ext/pipeline/run_record.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <fstream>
#include <system_error>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/json_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using Json = nlohmann::ordered_json;

Json ToJson(const std::vector<FileIdentity>& files) {
  Json json = Json::array();
  for (const FileIdentity& file : files) json.push_back(file.Text());
  return json;
}

std::vector<FileIdentity> FilesFromJson(const Json& json, const char* name) {
  std::vector<FileIdentity> files;
  for (const std::string& text : json.value(name, std::vector<std::string>{})) {
    files.push_back(FileIdentity::FromText(text));
  }
  return files;
}

Json ToJson(const TaskRecord& record) {
  Json json = {{"state", record.state}, {"key", record.key}};
  if (!record.files.empty()) json["files"] = ToJson(record.files);
  if (!record.earlier.empty()) json["earlier_files"] = ToJson(record.earlier);
  if (record.state == "pending") return json;
  json["seconds"] = record.seconds;
  json["peak_memory_bytes"] = record.peak_memory_bytes;
  json["warnings"] = record.warnings;
  if (!record.options_hash.empty()) json["options_hash"] = record.options_hash;
  return json;
}

TaskRecord FromJson(const Json& json) {
  TaskRecord record;
  record.state = json.at("state").get<std::string>();
  record.key = json.at("key").get<std::string>();
  record.seconds = json.value("seconds", 0.0);
  record.peak_memory_bytes = json.value("peak_memory_bytes", std::int64_t{0});
  record.warnings = json.value("warnings", std::vector<std::string>{});
  record.options_hash = json.value("options_hash", "");
  record.files = FilesFromJson(json, "files");
  record.earlier = FilesFromJson(json, "earlier_files");
  return record;
}

// Names of images are bytes, and JSON holds UTF-8 only. A name that JSON cannot hold, or that could be taken for
// one of these, has \xHH for its backslashes and for all bytes beyond ASCII.
std::string NameToJson(const std::string& name) {
  if (name.find('\\') == std::string::npos && IsUtf8(name)) return name;
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string text;
  for (const unsigned char c : name) {
    if (c < 0x80 && c != '\\') {
      text += static_cast<char>(c);
    } else {
      text += {'\\', 'x', kDigits[c >> 4], kDigits[c & 15]};
    }
  }
  return text;
}

std::string NameFromJson(const std::string& text) {
  std::string name;
  for (std::size_t i = 0; i < text.size(); ++i) {
    int byte = 0;
    const bool escaped =
        text.compare(i, 2, "\\x") == 0 && i + 4 <= text.size() &&
        std::from_chars(text.data() + i + 2, text.data() + i + 4, byte, 16).ptr == text.data() + i + 4;
    name += escaped ? static_cast<char>(byte) : text[i];
    if (escaped) i += 3;
  }
  return name;
}

// One write call, so that a killed process leaves at most a last line that breaks off.
void AppendLine(const std::filesystem::path& path, const std::string& line) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const ssize_t written = file < 0 ? -1 : write(file, line.data(), line.size());
  const int error = written < 0 ? errno : ENOSPC;  // a part was written
  if (file >= 0) close(file);
  if (written != static_cast<ssize_t>(line.size())) {
    throw phi::ResourceError("cannot write " + path.string() + ": " + std::generic_category().message(error) +
                             "; free some space and run the command again");
  }
}

}  // namespace

RunRecord::RunRecord(const std::filesystem::path& stereo_folder)
    : path_(stereo_folder / "phimvs.json"), journal_path_(stereo_folder / "phimvs.json.journal") {
  ReadFile();
  ReplayJournal();
}

void RunRecord::ReadFile() {
  if (!std::filesystem::exists(path_)) return;
  try {
    std::ifstream file = OpenRegularFile(path_);
    const Json json = ParseJson(file);
    options_hash_ = json.at("options_hash").get<std::string>();
    options_ = json.at("options").get<std::map<std::string, std::string>>();
    if (json.contains("runs")) {
      for (const Json& run : json["runs"]) runs_.push_back(DumpJson(run, -1));
    }
    for (const auto& [image, kinds] : json.at("images").items()) {
      for (const auto& [kind, record] : kinds.items()) tasks_[{NameFromJson(image), kind}] = FromJson(record);
    }
  } catch (const phi::ResourceError&) {
    throw;
  } catch (const std::exception& error) {  // of the parser, or of a stream that cannot be read
    throw phi::InputError(path_.string() + " is damaged (" + error.what() +
                          "); remove it and run again with --overwrite true to make all maps anew");
  }
}

// A line that is no record was cut short when the process was killed or the disk was full, and the next one may have been
// appended to it: their tasks count as pending.
void RunRecord::ReplayJournal() {
  std::ifstream file = OpenRegularFile(journal_path_);
  changed_ = file.is_open();
  for (std::string line; std::getline(file, line);) {
    try {
      const Json json = ParseJson(line);
      const Task task{NameFromJson(json.at("image").get<std::string>()), json.at("kind").get<std::string>()};
      TaskRecord record = FromJson(json);
      record.earlier = tasks_[task].earlier;
      tasks_[task] = record;
    } catch (const Json::exception&) {
      continue;
    } catch (const phi::InputError&) {
      continue;
    }
  }
}

const TaskRecord* RunRecord::Find(const std::string& image, const std::string& kind) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto it = tasks_.find({image, kind});
  return it == tasks_.end() ? nullptr : &it->second;
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
  }
  CompactLocked();
}

void RunRecord::Finish(const Task& task, const TaskRecord& record) {
  Json json = {{"image", NameToJson(task.first)}, {"kind", task.second}};
  std::lock_guard<std::mutex> lock(mutex_);
  TaskRecord finished = record;
  finished.options_hash = options_hash_;
  json.update(ToJson(finished));
  changed_ = true;
  AppendLine(journal_path_, DumpJson(json, -1) + "\n");
  TaskRecord& known = tasks_[task];
  std::vector<FileIdentity> earlier = std::move(known.earlier);
  known = std::move(finished);
  known.earlier = std::move(earlier);
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
  if (!changed_) return;
  for (auto& [task, record] : tasks_) {
    if (record.state == "done") record.earlier.clear();
  }
  CompactLocked();
  SyncFolder(path_.parent_path());
}

void RunRecord::CompactLocked() {
  Json images = Json::object(), runs = Json::array();
  for (const std::string& run : runs_) runs.push_back(Json::parse(run));
  for (const auto& [task, record] : tasks_) images[NameToJson(task.first)][task.second] = ToJson(record);
  const Json json = {{"version", PHIMVS_VERSION},
                     {"options", options_},
                     {"options_hash", options_hash_},
                     {"runs", runs},
                     {"images", images}};
  AtomicFile file(path_);  // an empty record after a power cut would cost all maps
  file.Write(DumpJson(json, 1) + "\n");
  file.Publish();
  std::filesystem::remove(journal_path_);
  changed_ = false;
}

}  // namespace colmap_ext
