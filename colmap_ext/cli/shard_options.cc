#include "colmap_ext/cli/shard_options.h"

#include <charconv>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// What the tasks of a job array find in their environment. Count and least may be unknown.
struct ArrayVariables {
  const char *index, *count, *least, *most;
};
constexpr ArrayVariables kArrays[] = {
    {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX"},
    {"AWS_BATCH_JOB_ARRAY_INDEX", "AWS_BATCH_JOB_ARRAY_SIZE", nullptr, nullptr},
    {"JOB_COMPLETION_INDEX", nullptr, nullptr, nullptr},
    {"PBS_ARRAY_INDEX", nullptr, nullptr, nullptr},
};

std::optional<int> ParseNumber(std::string_view text) {
  int value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size() || value < 0) return {};
  return value;
}

std::optional<int> NumberOf(const char* variable) {
  const char* text = variable != nullptr ? std::getenv(variable) : nullptr;
  return text != nullptr ? ParseNumber(text) : std::nullopt;
}

Shard MakeShard(int index, int count, const std::string& origin) {
  if (count < 1 || index >= count) {
    throw phi::UsageError(origin + ": there is no shard " + std::to_string(index) + " of " +
                          std::to_string(count) + "; they count from 0");
  }
  return {.index = index, .count = count, .only_stage = {}};
}

Shard ParseShard(const std::string& text) {
  const std::size_t slash = text.find('/');
  const std::optional<int> index = ParseNumber(std::string_view(text).substr(0, slash));
  const std::optional<int> count =
      slash == std::string::npos ? std::nullopt : ParseNumber(std::string_view(text).substr(slash + 1));
  if (!index || !count) throw phi::UsageError("--shard must be K/N, such as 0/8; it is '" + text + "'");
  return MakeShard(*index, *count, "--shard " + text);
}

// An array of all shards begins at 0 or at 1. One of tasks that are submitted again may not, and says nothing of the others; a lone
// task is a whole array where it is the first.
void RefusePartOfAnArray(const std::string& name, int least, int count) {
  if (least <= 1 && (count > 1 || least == 0)) return;
  const std::string tasks = count == 1 ? "task " + std::to_string(least) + " alone" : "tasks from " + std::to_string(least);
  throw phi::UsageError(
      name + ": the job array has " + tasks +
      ", as where failed tasks are submitted again; say how many shards there are with --num_shards, or give --shard K/N where the "
      "whole array began at 1; --shard 0/1 does all images");
}

// Without --num_shards: the array is all the shards, whether it begins at 0 or at 1.
Shard FromWholeArray(const ArrayVariables& array, int index) {
  const std::string name = array.index;
  const std::optional<int> count = NumberOf(array.count);
  if (!count) {
    phi::LogWarning(
        name +
        " is set, but nothing says how many shards there are: all images are done here; for a part "
        "of them add --num_shards");
    return {};
  }
  const int least = NumberOf(array.least).value_or(0),
            most = NumberOf(array.most).value_or(least + *count - 1);
  if (most - least + 1 != *count) {
    throw phi::UsageError(
        name +
        ": the job array has gaps, so that its tasks are not all shards; say how many there are "
        "with --num_shards");
  }
  RefusePartOfAnArray(name, least, *count);
  const Shard shard = MakeShard(index - least, *count, name);
  phi::LogInfo("shard " + shard.Name() + ", for " + name + " is " + std::to_string(index) +
               "; --shard 0/1 does all images");
  return shard;
}

}  // namespace

phi::OptionList ShardOptions::List() {
  phi::OptionList list;
  list.Add("shard", &shard,
           "K/N: the part K, from 0, of N of the images; default: as the job array says, else all");
  list.Add("num_shards", &num_shards,
           "Parts of the images, where the job array's index is the part; 0 = as it says")
      .AtLeast(0);
  return list;
}

Shard ShardOptions::Resolve() const {
  Shard resolved;
  if (!shard.empty()) {
    resolved = ParseShard(shard);
  } else {
    const ArrayVariables* found = nullptr;
    for (const ArrayVariables& array : kArrays) {
      if (found == nullptr && NumberOf(array.index)) found = &array;
    }
    if (found == nullptr && num_shards > 0)
      throw phi::UsageError("--num_shards: no job array says which one this is; give --shard K/N");
    if (found != nullptr) {
      const int index = *NumberOf(found->index);
      resolved = num_shards > 0 ? MakeShard(index, num_shards, found->index) : FromWholeArray(*found, index);
      if (num_shards > 0) phi::LogInfo("shard " + resolved.Name() + ", from " + found->index);
    }
  }
  resolved.only_stage = stage;
  return resolved;
}

}  // namespace colmap_ext
