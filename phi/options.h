// Options of every stage. List() describes each once: name, help, unit, range (base/option.h); a member that it leaves out
// has its meaning here. Check() returns an empty string, or one sentence naming option, value and rule.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "phi/base/hd.h"
#include "phi/base/option.h"
#include "phi/base/rules.h"

namespace phi {

// robust: the project's choices where the paper's formulas fail. paper: the paper's own, for ablations; with the options
// that --preset paper sets no rule is left that the paper does not have. Every branch on it is written as a comparison
// with one of the two and stands in docs/development/paper_mode.md.
enum class Formulas { kRobust, kPaper };

// The form in which the method runs: one of the two, and in the robust one the rules with their factors. All stages of a run
// have the same, fusion its own. Plain data: passed to kernels by value.
struct Method {
  Formulas formulas = Formulas::kRobust;
  Rules rules = {};

  PHI_HD constexpr Method(Formulas form = Formulas::kRobust, const Rules& of_robust = {}) : formulas(form), rules(of_robust) {}
  // Of what the rule changes: the paper's where it is off.
  PHI_HD Formulas FormulasOf(Rule rule) const { return rules.IsOn(rule) ? formulas : Formulas::kPaper; }
};

enum class Quality { kStandard, kFast };

struct ViewSelectionOptions {
  int num_source_views = 8;             // that matching compares
  int num_witness_views = 16;           // that confirm or refute depths: these and more
  double displacement_epsilon = 0.002;  // eps of Eq. 1, relative depth change
  double min_displacement = 0.1;        // t_tau of Eq. 2, pixels at the working resolution
  double min_triangulation_angle = 1;   // degrees
  Method method = {};

  // What is selected: the views to match, best first, and the witnesses behind them.
  int NumSelectedViews() const { return std::max(num_source_views, num_witness_views); }
  OptionList List();
  std::string Check() const;
};

struct StereoOptions {
  double window_radius = 7;  // r_orig, pixels
  double window_step = 1.4;  // r_orig / r_now, pixels
  int num_iterations = 8;
  int num_window_levels = 3;
  Method method = {};  // the one that is on the list; PipelineOptions::SetMethod hands it to the other stages
  Quality quality = Quality::kStandard;
  std::uint32_t seed = 0;  // --default_random_seed, which every command has

  // r_now: samples on each side of the centre; the window has (2 r_now + 1)^2 samples.
  int SamplesPerSide() const;
  OptionList List();
  std::string Check() const;
};

inline constexpr int kMaxRequiredViews = 255;  // the filter counts them in a byte

// Geometric consistency (paper section D).
struct FilterOptions {
  int min_num_consistent = 1;           // source views
  int min_num_consistent_inferred = 1;  // the same for inferred pixels
  double max_reprojection_error = 1;    // pixels
  double max_relative_depth_error = 0.01;
  double max_depth_error = 0;          // world units; 0: the relative one counts
  double max_normal_error = 60;        // degrees
  double min_triangulation_angle = 0;  // degrees; 0 = off
  double min_ncc = -1;                 // 1 - matching cost; -1 = off; never applied to filled pixels
  Method method = {};

  bool UsesCost() const { return min_ncc > -1; }
  OptionList List();
  std::string Check() const;
};

enum class InferenceMode { kOff, kMinCost, kMrf };

// Plane hypothesis inference (paper section E).
struct InferenceOptions {
  InferenceMode mode = InferenceMode::kMrf;
  int num_passes = 1;               // of TRW-S
  double kappa1 = 4, kappa2 = 0.5;  // Eq. 6
  double kappa3 = 2;                // Eq. 7
  double truncation = 1;            // of the relative difference in Eq. 7
  Method method = {};
  OptionList List();
  std::string Check() const;
};

}  // namespace phi
