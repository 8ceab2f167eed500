// Which results of a run's stages are still to be made.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/stage_graph.h"
#include "phi/base/message.h"
#include "phi/matching/cost_aggregation.h"

namespace colmap_ext {

// One reference image of patch-match.cfg.
struct ImageJob {
  int image = 0;                 // index into the workspace's views
  std::vector<int> sources;      // likewise, best first: those to match, and behind them those that are witnesses alone
  std::vector<int> source_jobs;  // parallel to sources: index of the job that makes the source's map, or -1
  int max_matched = phi::kMaxSourceViews;
  std::string input_key;         // hash of cameras, image files and sparse points: of the image and the sources to match
  std::string witness_key;       // hash of cameras and image files of the others
  bool file_is_missing = false;
  phi::Message problem;  // not empty: the job cannot run, for this reason
  bool keeps_measured = false;  // its measured map is another program's: inference fills holes alone

  std::size_t NumMatched() const { return std::min(sources.size(), static_cast<std::size_t>(max_matched)); }
};

// The jobs whose maps of the stage before this one a job reads: its own first.
std::vector<int> InputJobs(const Stage& stage, const std::vector<ImageJob>& jobs, int job);

// What a process takes on: these images in these stages. The rest is other processes'.
struct PlanScope {
  std::vector<char> own;  // by job; empty: all
  int first_stage = 0, end_stage = std::numeric_limits<int>::max();

  bool Owns(int stage, int job) const {
    return stage >= first_stage && stage < end_stage && (own.empty() || own[static_cast<std::size_t>(job)] != 0);
  }
};

// A task that needs a map of the stage before, which others make and have not made yet.
struct WaitingTask {
  int job = 0, input_job = 0;
};

struct StagePlan {
  std::vector<std::string> keys;     // by job; empty: the result cannot be made
  std::vector<int> pending;          // jobs of the scope whose result is wanted and not there, and can be made
  std::vector<WaitingTask> waiting;  // those that cannot be made yet
};

struct PlanQueries {
  std::function<bool(int stage, int job, const std::string& key)> is_done;
  std::function<bool(int stage, int job, const std::string& key)> has_failed;
};

// A result's key covers its options, its inputs and their keys: a change anywhere before it makes it pending.
std::vector<StagePlan> MakePlan(const std::vector<Stage>& stages, const std::vector<ImageJob>& jobs,
                                const PlanQueries& queries, const PlanScope& scope = {});
bool HasPending(const std::vector<StagePlan>& plan);

// The jobs whose input keys MakePlan needs for the scope, ascending: its own, those that read its results, and what all of
// these read, stage by stage. The keys of others are not looked at.
std::vector<int> JobsInReach(const std::vector<Stage>& stages, const std::vector<ImageJob>& jobs, const PlanScope& scope);

}  // namespace colmap_ext
