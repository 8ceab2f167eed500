#include "colmap_ext/pipeline/task_record.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <system_error>

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

}  // namespace

Json RecordToJson(const TaskRecord& record) {
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

TaskRecord RecordFromJson(const Json& json) {
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

std::string JournalLine(const RecordedTask& task, const TaskRecord& record) {
  Json json = {{"image", NameToJson(task.first)}, {"kind", task.second}};
  json.update(RecordToJson(record));
  return DumpJson(json, -1) + "\n";
}

std::pair<RecordedTask, TaskRecord> FromJournalLine(const Json& json) {
  return {{NameFromJson(json.at("image").get<std::string>()), json.at("kind").get<std::string>()}, RecordFromJson(json)};
}

void AppendLine(const std::filesystem::path& path, const std::string& line) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const ssize_t written = file < 0 ? -1 : write(file, line.data(), line.size());
  bool is_whole = written == static_cast<ssize_t>(line.size());
  int error = written < 0 ? errno : ENOSPC;  // a part was written
  // Else the next line would be joined to this part, and both be lost.
  if (written > 0 && !is_whole && ftruncate(file, lseek(file, 0, SEEK_CUR) - written) != 0) error = errno;
  if (file >= 0 && close(file) != 0) {  // network file systems report a full disk here
    if (is_whole) error = errno;
    is_whole = false;
  }
  if (!is_whole) {
    throw phi::ResourceError("cannot write " + phi::AboutFile(path) + ": " + std::generic_category().message(error) +
                             "; free some space and run the command again");
  }
}

}  // namespace colmap_ext
