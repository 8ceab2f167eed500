#include "colmap_ext/pipeline/shard_journals.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "colmap_ext/input_file.h"
#include "colmap_ext/json_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kSuffix[] = ".journal";

Json ToJson(const ShardProcess& process) {
  return {{"shard", process.shard},           {"only_stage", process.only_stage}, {"options_hash", process.options_hash},
          {"generation", process.generation}, {"workers", process.num_workers},   {"images", process.num_images},
          {"stages", process.stages}};
}

ShardProcess ProcessFromJson(const Json& json) {
  ShardProcess process;
  process.shard = json.at("shard").get<std::string>();
  process.only_stage = json.at("only_stage").get<std::string>();
  process.options_hash = json.at("options_hash").get<std::string>();
  process.generation = json.at("generation").get<int>();
  process.num_workers = json.at("workers").get<int>();
  process.num_images = json.at("images").get<int>();
  process.stages = json.at("stages").get<std::vector<std::string>>();
  return process;
}

// "3-of-8" of "3/8".
std::string FileStem(std::string shard) {
  const std::size_t slash = shard.find('/');
  return slash == std::string::npos ? shard : shard.replace(slash, 1, "-of-");
}

// "3/8" of "3-of-8.0.journal": whose it is, if the process was killed before it said so.
std::string ShardOfName(const fs::path& path) {
  const std::string name = path.filename().string();
  const std::size_t of = name.find("-of-"), dot = name.find('.');
  if (of == std::string::npos || dot == std::string::npos || dot < of) return "";
  return name.substr(0, of) + "/" + name.substr(of + 4, dot - of - 4);
}

// Whether `later` does what `earlier` was to do. One that was killed before its first line has generation 0, and did nothing yet
// of whichever stage.
bool DoesAgain(const ShardProcess& later, const ShardProcess& earlier) {
  return later.shard == earlier.shard && later.generation > earlier.generation &&
         (earlier.generation == 0 || later.only_stage == earlier.only_stage);
}

// From `offset` on, up to the last end of a line: what a process is just writing has none yet.
std::string ReadWholeLines(const fs::path& path, std::uint64_t offset) {
  std::ifstream file = OpenRegularFile(path);
  file.seekg(static_cast<std::streamoff>(offset));
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const std::size_t end = text.rfind('\n');
  text.resize(end == std::string::npos ? 0 : end + 1);
  return text;
}

}  // namespace

ShardJournals::ShardJournals(const fs::path& stereo_folder) : folder_(stereo_folder / "phimvs.shards") {}

std::vector<ShardLine> ShardJournals::ReadNew() {
  std::vector<fs::path> paths;
  std::error_code error;  // no folder: no journals
  for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() == kSuffix && it->path() != own_) paths.push_back(it->path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<ShardLine> lines;
  for (const fs::path& path : paths) ReadJournal(path, &lines);
  std::stable_sort(lines.begin(), lines.end(),
                   [](const ShardLine& a, const ShardLine& b) { return a.generation < b.generation; });
  return lines;
}

// A line that is no record was cut short: its task counts as not done.
void ShardJournals::ReadJournal(const fs::path& path, std::vector<ShardLine>* lines) {
  Journal& journal = journals_[path];
  if (journal.process.shard.empty()) journal.process.shard = ShardOfName(path);
  const std::string text = ReadWholeLines(path, journal.num_bytes_read);
  journal.num_bytes_read += text.size();
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    const std::string line = text.substr(begin, end - begin);
    begin = end + 1;
    try {
      const Json json = ParseJson(line);
      if (json.contains("shard")) {
        journal.process = ProcessFromJson(json);
      } else if (json.contains("ended")) {
        journal.process.has_ended = true;
      } else {
        auto [task, record] = FromJournalLine(json);
        lines->push_back({std::move(task), std::move(record), journal.process.generation});
      }
    } catch (const Json::exception&) {
      continue;
    } catch (const phi::InputError&) {
      continue;
    }
  }
}

std::vector<ShardProcess> ShardJournals::Processes() const {
  std::vector<ShardProcess> processes;
  for (const auto& [path, journal] : journals_) processes.push_back(journal.process);
  return processes;
}

bool ShardJournals::HasUnended(const ShardProcess& process) const {
  return std::any_of(journals_.begin(), journals_.end(), [&](const auto& entry) {
    const ShardProcess& other = entry.second.process;
    return !other.has_ended && DoesAgain(process, other);
  });
}

bool ShardJournals::IsOver(const ShardProcess& process) const {
  return process.has_ended || std::any_of(journals_.begin(), journals_.end(), [&](const auto& entry) {
           const ShardProcess& other = entry.second.process;
           return other.has_ended && DoesAgain(other, process);
         });
}

void ShardJournals::RemoveEnded() {
  std::vector<fs::path> over;
  for (const auto& [path, journal] : journals_) {
    if (IsOver(journal.process)) over.push_back(path);
  }
  std::error_code ignored;  // one that stays says nothing new
  for (const fs::path& path : over) {
    fs::remove(path, ignored);
    journals_.erase(path);
  }
  fs::remove(folder_, ignored);  // where it is empty
}

void ShardJournals::Open(const ShardProcess& process) {
  std::error_code error;
  fs::create_directories(folder_, error);
  for (int i = 0;; ++i) {
    own_ = folder_ / (FileStem(process.shard) + "." + std::to_string(i) + kSuffix);
    const int file = ::open(own_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (file < 0 && (errno == EEXIST || errno == EINTR)) continue;
    if (file < 0) {
      throw phi::ResourceError("cannot make " + phi::AboutFile(own_) + ": " + std::generic_category().message(errno) +
                               "; check that the folder can be written, and run the command again");
    }
    ::close(file);
    try {
      return Append(DumpJson(ToJson(process), -1) + "\n");
    } catch (const phi::ResourceError&) {
      ::unlink(own_.c_str());  // without this line nobody knows whose it is, and it would stay
      own_.clear();
      throw;
    }
  }
}

void ShardJournals::Append(const std::string& line) const { AppendLine(own_, line); }

}  // namespace colmap_ext
