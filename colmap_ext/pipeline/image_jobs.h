// From a workspace to the list of tasks: which images to estimate, and from which source views.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/stage_plan.h"
#include "colmap_ext/workspace.h"
#include "phi/sparse_scene.h"

namespace colmap_ext {

// The sparse model as the dense stages need it; views as in workspace.views().
phi::SparseScene MakeSparseScene(const SparseModel& model);

// "19 images, 1248x832, 8 source views each", as ranges where images differ.
std::string DescribeJobs(const Workspace& workspace, const std::vector<ImageJob>& jobs);

// In the order of patch-match.cfg, with sources selected where the file says __auto__. config_path empty: the
// workspace's own file.
std::vector<ImageJob> MakeImageJobs(const Workspace& workspace, const phi::SparseScene& scene,
                                    const std::filesystem::path& config_path,
                                    const phi::ViewSelectionOptions& options);

// The two halves of MakeImageJobs, for who needs not all of them: the images and their sources, and what is read of the files
// of some of them, `which`: input keys, missing files, problems.
std::vector<ImageJob> ListImageJobs(const Workspace& workspace, const phi::SparseScene& scene,
                                    const std::filesystem::path& config_path,
                                    const phi::ViewSelectionOptions& options);
void AddInputs(const Workspace& workspace, const phi::SparseScene& scene, phi::Formulas formulas,
               const std::vector<int>& which, std::vector<ImageJob>* jobs);

// That no image can be done, and why the first cannot, at this stage; empty where one can.
phi::Message DescribeImpossible(const std::vector<ImageJob>& jobs, const std::string& stage);

// Of all images of a workspace in memory; sources: the views that each image is matched with, best first, or empty for
// those that are selected.
std::vector<ImageJob> MakeMemoryJobs(const Workspace& workspace, const phi::SparseScene& scene,
                                     const std::vector<std::vector<int>>& sources,
                                     const phi::ViewSelectionOptions& options);

}  // namespace colmap_ext
