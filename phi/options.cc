#include "phi/options.h"

#include <cmath>

#include "phi/inference/mrf_potentials.h"

namespace phi {

int StereoOptions::SamplesPerSide() const {
  return static_cast<int>(std::lround(window_radius / window_step));
}

OptionList ViewSelectionOptions::List() {
  constexpr const char* kInSources = "the keys hold the source images that it chose";
  OptionList list;
  list.Add("PatchMatchStereo.min_triangulation_angle", &min_triangulation_angle,
           "Smallest angle between an image and a source image that __auto__ selects")
      .Unit("degrees")
      .ColmapDefault("1")
      .AtLeast(0)
      .LessThan(90)
      .NotInKey(kInSources);
  list.Add("PhiStereo.num_source_views", &num_source_views,
           "Most source images that matching compares, of those that __auto__ in patch-match.cfg selects")
      .Between(1, 32)
      .NotInKey(kInSources);
  list.Add("PhiStereo.num_witness_views", &num_witness_views,
           "Most source images that __auto__ selects to confirm or refute depths; those to match are among them")
      .Between(1, 32)
      .NotInKey(kInSources);
  list.Add("PhiStereo.min_displacement", &min_displacement,
           "Least mean shift of shared points in a source view where their depth changes by 0.2 %")
      .Unit("pixels")
      .AtLeast(0)
      .NotInKey(kInSources);
  return list;
}

std::string ViewSelectionOptions::Check() const { return ViewSelectionOptions(*this).List().Check(); }

OptionList StereoOptions::List() {
  OptionList list;
  list.AddChoice<Formulas>("PhiStereo.formulas", &method.formulas,
                           {{"robust", Formulas::kRobust}, {"paper", Formulas::kPaper}},
                           "paper = the paper's equations; --preset paper sets this and its values");
  list.AddRules("PhiStereo.rules", &method.rules, RuleStage::kSourceViews, RuleStage::kInference)
      .NotInKey("each stage's key holds its own rules");
  list.Add("PatchMatchStereo.num_iterations", &num_iterations, "Rounds of propagation and refinement")
      .ColmapDefault("5")
      .Between(1, 100);
  list.AddChoice<Quality>("PhiStereo.quality", &quality,
                          {{"standard", Quality::kStandard}, {"fast", Quality::kFast}},
                          "fast = fewer iterations at full size: less detail, less time");
  list.Add("PhiStereo.num_window_levels", &num_window_levels,
           "1 + how often the window may double where there is no texture")
      .Between(1, 4);
  list.Add("PatchMatchStereo.window_radius", &window_radius, "Half the side of the matching window")
      .Unit("pixels")
      .ColmapDefault("5")
      .Between(1, 32);
  list.Add("PatchMatchStereo.window_step", &window_step, "Distance between the window's samples")
      .Unit("pixels")
      .ColmapDefault("1")
      .AtLeast(1);
  return list;
}

std::string StereoOptions::Check() const {
  StereoOptions copy = *this;
  const OptionList list = copy.List();
  if (const std::string problem = list.Check(); !problem.empty()) return problem;
  if (window_step <= window_radius) return "";
  return "--PatchMatchStereo.window_step is " + list.Find("PatchMatchStereo.window_step")->Text() +
         ", but must be at most --PatchMatchStereo.window_radius";
}

OptionList FilterOptions::List() {
  OptionList list;
  list.Add("PatchMatchStereo.filter_min_ncc", &min_ncc,
           "Smallest matching score (1 - cost) of a kept pixel; -1 = off. Filled pixels are not asked")
      .ColmapDefault("0.1")
      .Between(-1, 1);
  list.Add("PatchMatchStereo.filter_min_triangulation_angle", &min_triangulation_angle,
           "Smallest angle at the surface point that one confirming image must reach; 0 = off")
      .Unit("degrees")
      .ColmapDefault("3")
      .AtLeast(0)
      .LessThan(90);
  list.Add("PatchMatchStereo.filter_min_num_consistent", &min_num_consistent,
           "Fewest source images that confirm a measured pixel")
      .Unit("source views")
      .ColmapDefault("2")
      .Between(0, kMaxRequiredViews);
  list.Add("PatchMatchStereo.filter_geom_consistency_max_cost", &max_reprojection_error,
           "Largest forward-backward reprojection error of an image that confirms a measured pixel")
      .Unit("pixels")
      .ColmapDefault("1")
      .MoreThan(0);
  list.Add("PhiStereo.filter_max_relative_depth_error", &max_relative_depth_error,
           "Largest difference in depth of a confirming image, relative to depth")
      .MoreThan(0)
      .LessThan(1);
  list.Add("PhiStereo.filter_max_depth_error", &max_depth_error,
           "The same as a length, in place of the relative one; 0 = off")
      .Unit("world units")
      .AtLeast(0);
  list.Add("PhiStereo.filter_max_normal_error", &max_normal_error,
           "Largest angle between the normals of an image and of one that confirms it")
      .Unit("degrees")
      .Between(0, 180)
      .MoreThan(0);
  list.Add("PhiInference.min_num_consistent", &min_num_consistent_inferred,
           "Fewest source images that confirm an inferred pixel")
      .Unit("source views")
      .Between(0, kMaxRequiredViews);
  return list;
}

std::string FilterOptions::Check() const { return FilterOptions(*this).List().Check(); }

OptionList InferenceOptions::List() {
  OptionList list;
  list.AddChoice<InferenceMode>(
      "PhiInference.mode", &mode,
      {{"off", InferenceMode::kOff}, {"min_cost", InferenceMode::kMinCost}, {"mrf", InferenceMode::kMrf}},
      "Filling of holes: off = none; min_cost = each pixel takes the plane that matches best; "
      "mrf = neighbours choose their planes together");
  list.Add("PhiInference.num_passes", &num_passes, "Rounds of the neighbours' choice (mrf)").Between(1, 1000);
  list.Add("PhiInference.truncation", &truncation,
           "Relative difference in depth from which neighbours count as different surfaces (mrf)")
      .Between(0, 1)
      .MoreThan(0);
  return list;
}

std::string InferenceOptions::Check() const {
  if (const std::string problem = InferenceOptions(*this).List().Check(); !problem.empty()) return problem;
  if (!(kappa1 > 0 && kappa2 > 0)) return "kappa1 and kappa2 must be positive";
  return -2 * std::log(1 - truncation / kappa3) <= kMaxPairwiseNats ? "" : "kappa3 must be more than the truncation, by a thousandth of it";
}

}  // namespace phi
