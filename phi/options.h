// Options of every stage, with units and defaults. Names in comments are those of the command line, so that
// an error message can quote them. Each Check() returns an empty string, or one sentence naming option, value
// and rule.
#pragma once

#include <cstdint>
#include <string>

namespace phi {

// robust: the project's choices where the paper's formulas fail. paper: the paper's own, for ablations; with the options
// that --preset paper sets no rule is left that the paper does not have. Every branch on it is written as a comparison
// with one of the two and stands in docs/development/paper_mode.md.
enum class Formulas { kRobust, kPaper };
enum class Quality { kStandard, kFast };

struct ViewSelectionOptions {
  int num_source_views = 8;             // --PhiStereo.num_source_views: most views that __auto__ selects
  double displacement_epsilon = 0.002;  // eps of Eq. 1, relative depth change
  double min_displacement =
      0.1;  // --PhiStereo.min_displacement: t_tau of Eq. 2, pixels at the working resolution
  double min_triangulation_angle = 1;  // --PatchMatchStereo.min_triangulation_angle, degrees
  Formulas formulas = Formulas::kRobust;
  std::string Check() const;
};

struct StereoOptions {
  double window_radius = 7;   // --PatchMatchStereo.window_radius: r_orig, pixels
  double window_step = 1.4;   // --PatchMatchStereo.window_step: r_orig / r_now, pixels between samples
  int num_iterations = 8;     // --PatchMatchStereo.num_iterations
  int num_window_levels = 3;  // --PhiStereo.num_window_levels: 1 + how often a faint window may double
  Formulas formulas = Formulas::kRobust;  // --PhiStereo.formulas
  Quality quality = Quality::kStandard;   // --PhiStereo.quality
  std::uint32_t seed = 0;                 // --default_random_seed

  // r_now: samples on each side of the centre; the window has (2 r_now + 1)^2 samples.
  int SamplesPerSide() const;
  std::string Check() const;
};

// Geometric consistency (paper section D).
struct FilterOptions {
  int min_num_consistent = 2;              // --PatchMatchStereo.filter_min_num_consistent, source views
  int min_num_consistent_inferred = 1;     // --PhiInference.min_num_consistent: the same for inferred pixels
  double max_reprojection_error = 1;       // --PatchMatchStereo.filter_geom_consistency_max_cost, pixels
  double max_relative_depth_error = 0.01;  // --PhiStereo.filter_max_relative_depth_error
  double max_depth_error = 0;  // --PhiStereo.filter_max_depth_error, world units; 0: the relative one counts
  double max_normal_error = 60;        // --PhiStereo.filter_max_normal_error, degrees
  double min_triangulation_angle = 0;  // --PatchMatchStereo.filter_min_triangulation_angle, degrees; 0 = off
  double max_cost = 2;  // 1 - --PatchMatchStereo.filter_min_ncc; 2 = off; never applied to filled pixels
  Formulas formulas = Formulas::kRobust;
  std::string Check() const;
};

enum class InferenceMode { kOff, kMinCost, kMrf };

// Plane hypothesis inference (paper section E).
struct InferenceOptions {
  InferenceMode mode = InferenceMode::kMrf;  // --PhiInference.mode
  int num_passes = 1;                        // --PhiInference.num_passes: TRW-S passes
  double kappa1 = 4, kappa2 = 0.5;           // Eq. 6
  double kappa3 = 2;                         // Eq. 7
  double truncation = 1;                     // --PhiInference.truncation: of the relative difference in Eq. 7
  Formulas formulas = Formulas::kRobust;
  std::string Check() const;
};

}  // namespace phi
