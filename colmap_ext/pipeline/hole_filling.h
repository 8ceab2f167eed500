// Plane hypothesis inference and the second filter on maps that are already there: hole_filler's work.
//
// Always starts from <image>.measured.bin. Where <image>.geometric.bin is another program's, it gets that name first, so
// that running twice gives the same bytes.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_ext/pipeline/stage_runner.h"

namespace colmap_ext {

class HoleFilling {
 public:
  // `effective_options` goes into phimvs.json for the reader. References must outlive it.
  HoleFilling(const Workspace& workspace, std::vector<ImageJob> jobs, const PipelineOptions& options,
              const std::map<std::string, std::string>& effective_options, const Backends& backends);

  // Writes <image>.geometric.bin and the filled masks. Throws phi::InputError when no image has maps, or when another
  // program's would be replaced without --overwrite; images that
  // fail, those with damaged maps among them, are in the summary, those without maps are left out, and all others are done.
  RunSummary Run();

 private:
  void FindMeasuredMaps();
  void RecordImpossibleJobs();
  bool MapsAreOurs(int job, std::string_view kind) const;
  bool GeometricMapIsOurs(int job) const;
  bool ImportMeasuredMap(int job);
  bool HasSomeMap(int job, std::string_view kind) const;
  phi::Message ProblemOfMaps(int job) const;
  void SaveNoMarks(int job) const;
  std::vector<StagePlan> Plan() const;
  const std::string& NameOf(int job) const { return runner_.NameOf(job); }

  const Workspace& workspace_;
  const PipelineOptions options_;
  std::vector<ImageJob> jobs_;
  StageRunner runner_;
  std::vector<char> has_map_;  // by job: a measured one
};

}  // namespace colmap_ext
