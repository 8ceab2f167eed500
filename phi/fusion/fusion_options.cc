#include "phi/fusion/fusion_options.h"

namespace phi {

OptionList FusionOptions::List() {
  OptionList list;
  list.AddChoice<Formulas>("PhiFusion.formulas", &method.formulas,
                           {{"robust", Formulas::kRobust}, {"paper", Formulas::kPaper}},
                           "paper = the paper's fusion; --preset paper sets this and its values");
  list.AddRules("PhiFusion.rules", &method.rules, RuleStage::kFusion, RuleStage::kFusion);
  list.Add("StereoFusion.min_num_pixels", &min_num_views, "Images that must agree on a point")
      .ColmapDefault("5")
      .AtLeast(1);
  list.Add("StereoFusion.max_num_pixels", &max_num_views, "Most measurements merged into a point")
      .ColmapDefault("10000")
      .AtLeast(1);
  list.Add("StereoFusion.max_reproj_error", &max_reproj_error,
           "Largest distance in the other image between the points at both depths")
      .Unit("pixels")
      .ColmapDefault("2")
      .MoreThan(0);
  list.Add("StereoFusion.max_depth_error", &max_depth_error, "Largest difference of two depths, relative to depth")
      .ColmapDefault("0.0099999997764825821")
      .MoreThan(0)
      .LessThan(0.5);
  list.Add("StereoFusion.max_normal_error", &max_normal_error, "Largest angle between normals")
      .Unit("degrees")
      .ColmapDefault("10")
      .Between(0, 90)
      .MoreThan(0);
  list.Add("PhiFusion.max_normal_error_in_holes", &max_normal_error_in_holes,
           "Largest angle between normals in holes of the cloud, if larger than max_normal_error")
      .Unit("degrees")
      .Between(0, 90);
  list.Add("PhiFusion.min_support", &min_support,
           "Least sum of the other images' agreements, each between 0 and 1")
      .AtLeast(0);
  list.Add("PhiFusion.min_support_inferred", &min_support_inferred,
           "The same for pixels whose depth was inferred, if larger than min_support")
      .AtLeast(0);
  list.Add("PhiFusion.max_conflicts", &max_conflicts, "Most images that see through a point, for each that supports it")
      .AtLeast(0);
  list.Add("PhiFusion.min_confidence", &min_confidence, "Points less probably right than this are left out").Between(0, 1);
  return list;
}

std::string FusionOptions::Check() const {
  if (const std::string problem = FusionOptions(*this).List().Check(); !problem.empty()) return problem;
  if (max_num_views >= min_num_views) return "";
  return "--StereoFusion.max_num_pixels is " + std::to_string(max_num_views) +
         ", but must be at least --StereoFusion.min_num_pixels";
}

}  // namespace phi
