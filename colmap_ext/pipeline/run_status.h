// How far the stereo of a workspace is, told by its records alone: no map and no photo is read.
#pragma once

#include <string>
#include <vector>

#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "phi/base/message.h"

namespace colmap_ext {

struct StageStatus {
  std::string name;
  int num_done = 0, num_failed = 0, num_waiting = 0;  // images; failed: in this stage or one before
  double seconds_per_image = 0;                       // mean of the tasks that are done; 0: none is
};

struct RunStatus {
  int num_images = 0;
  std::vector<StageStatus> stages;
  std::vector<phi::Message> failures;    // one for each image that failed, about it and its stage
  std::vector<std::string> open_shards;  // "3/8" at work, or killed and not started again
  double pace = 0;                       // seconds of tasks in each second: of these shards, else of the run; 0: not known
  double seconds_left = 0;               // of the stages that one map at least tells the time of; < 0: not known
  std::string unknown_stage;             // the first that has none yet; empty: all have
};

// Of the options of the last run.
RunStatus FindStatus(const RunRecord& record);

// A table, what is at work, the time left and the failures.
std::string StatusText(const RunStatus& status, LockUse use);

}  // namespace colmap_ext
