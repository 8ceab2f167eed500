// What is known of a result, and its form as JSON: in stereo/phimvs.json, and as a line of the journals.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "colmap_ext/pipeline/file_identity.h"

namespace colmap_ext {

struct TaskRecord {
  std::string
      state;  // "pending": its files may be missing or old; "done": they are, or were about to be, there; "failed"
  std::string key;  // hash of the options and the inputs that the result depends on
  double seconds = 0;
  std::int64_t peak_memory_bytes = 0;      // of the process, when the task ended
  std::vector<std::string> warnings = {};  // for a failed task, why
  std::vector<FileIdentity> files = {};    // of the result; none where an earlier program made it
  std::vector<FileIdentity> earlier = {};  // of earlier results that may still lie under its names
  std::string options_hash = {};  // of the last run that made it or found it up to date; empty: not known

  // Those that nobody knows the options of are taken for any run's.
  bool IsOfOptions(const std::string& hash) const { return options_hash.empty() || options_hash == hash; }
};

using RecordedTask = std::pair<std::string, std::string>;  // (image name, kind of result)

nlohmann::ordered_json RecordToJson(const TaskRecord& record);
// Throws nlohmann's exceptions, phi::InputError.
TaskRecord RecordFromJson(const nlohmann::ordered_json& json);

// Names of images are bytes, and JSON holds UTF-8 only. A name that JSON cannot hold, or that could be taken for one of
// these, has \xHH for its backslashes and for all bytes beyond ASCII.
std::string NameToJson(const std::string& name);
std::string NameFromJson(const std::string& text);

// A line of a journal, with its end.
std::string JournalLine(const RecordedTask& task, const TaskRecord& record);
// Throws as RecordFromJson.
std::pair<RecordedTask, TaskRecord> FromJournalLine(const nlohmann::ordered_json& json);
// Makes the file where it is missing; no other process writes it. One write call, so that a killed process leaves at most a last
// line that breaks off. Throws phi::ResourceError, and leaves no part of a line then.
void AppendLine(const std::filesystem::path& path, const std::string& line);

}  // namespace colmap_ext
