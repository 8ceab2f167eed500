// What a run reports when it ends: time by stage, speed, memory, failures.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "phi/backend.h"
#include "phi/base/error.h"

namespace colmap_ext {

struct StageSummary {
  std::string name;
  int num_made = 0;
  double seconds = 0;  // from its first task's begin to its last one's end: stages overlap
  // Of the maps made; no pixels: not counted.
  std::int64_t num_pixels = 0, num_with_depth = 0;
};

struct DeviceSummary {
  std::string name;
  std::int64_t peak_bytes = 0;  // 0: not told
  std::vector<phi::DeviceStageTime> stages;
};

// What became of the holes of all images, in pixels; the field's share on its grid of every other pixel.
struct InferenceSummary {
  std::int64_t num_holes = 0;      // before
  std::int64_t num_confirmed = 0;  // inferred, and some source view's measurement agrees
  std::int64_t num_alone = 0;      // inferred, and none does
  std::int64_t num_kept = 0;       // of both, after the second filter
  phi::FieldStatistics field;      // sums
};

struct RunSummary {
  std::vector<StageSummary> stages;
  InferenceSummary inference;
  std::vector<DeviceSummary> devices;
  std::vector<phi::Message> failures;  // one for each image that failed, about it and its stage
  std::vector<phi::Message> left_out;  // one for each image that is left out, with a warning
  int num_too_large = 0;         // of those that failed, because no device's memory holds them
  int num_images = 0;            // reference images of the job, without those that are left out
  int num_images_kept = 0;       // their results were there and up to date
  int num_failed_earlier = 0;    // images of a run of one stage (--stage) that failed in a stage before it
  int num_images_waiting = 0;    // images of a shard whose last maps cannot be made yet
  int num_waiting = 0;           // tasks of a shard that need maps which others have not made yet
  double seconds = 0;            // wall time of the whole run
  std::int64_t peak_host_bytes = 0;
  std::int64_t peak_cache_bytes = 0;
  std::int64_t bytes_written = 0;
  double write_seconds = 0;  // summed over the writers

  // Ok, retry later, some images failed, or why all did: bad input, or too little memory.
  phi::ExitCode Code() const;
  // Images whose results are there now.
  int NumDone() const;
  // Those of them that this run made.
  int NumMade() const;
};

DeviceSummary SummarizeDevice(const phi::Backend& backend);

// Peak resident memory of this process.
std::int64_t PeakHostBytes();

// What was done, in one sentence.
std::string SummaryLine(const RunSummary& summary);
// Times by stage, what became of the holes, memory and disk: one line each.
std::vector<std::string> SummaryDetails(const RunSummary& summary);
// Logs both, the details at level 3, and by their reasons which images failed or were left out.
void LogSummary(const RunSummary& summary);

// The same as a JSON object, for phimvs.json. `finished`: when, as phi::UtcNow tells it.
std::string SummaryJson(const RunSummary& summary, const std::string& finished);

}  // namespace colmap_ext
