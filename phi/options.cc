#include "phi/options.h"

#include <cmath>
#include <sstream>

#include "phi/filtering/filter_pixel.h"

namespace phi {
namespace {

// Collects the first broken rule.
class Rules {
 public:
  template <typename T>
  Rules& Require(bool holds, const char* option, const T& value, const char* rule) {
    if (!holds && message_.empty()) {
      std::ostringstream out;
      out << option << " is " << value << ", but must be " << rule;
      message_ = out.str();
    }
    return *this;
  }
  std::string message() const { return message_; }

 private:
  std::string message_;
};

}  // namespace

int StereoOptions::SamplesPerSide() const {
  return static_cast<int>(std::lround(window_radius / window_step));
}

std::string ViewSelectionOptions::Check() const {
  return Rules()
      .Require(num_source_views >= 1 && num_source_views <= 32, "--PhiStereo.num_source_views",
               num_source_views, "between 1 and 32")
      .Require(min_displacement >= 0, "--PhiStereo.min_displacement", min_displacement, "0 or more pixels")
      .Require(min_triangulation_angle >= 0 && min_triangulation_angle < 90,
               "--PatchMatchStereo.min_triangulation_angle", min_triangulation_angle, "in [0, 90) degrees")
      .message();
}

std::string StereoOptions::Check() const {
  return Rules()
      .Require(window_radius >= 1 && window_radius <= 32, "--PatchMatchStereo.window_radius", window_radius,
               "between 1 and 32 pixels")
      .Require(window_step >= 1 && window_step <= window_radius, "--PatchMatchStereo.window_step",
               window_step, "between 1 and window_radius pixels")
      .Require(num_iterations >= 1 && num_iterations <= 100, "--PatchMatchStereo.num_iterations",
               num_iterations, "between 1 and 100")
      .Require(num_window_levels >= 1 && num_window_levels <= 4, "--PhiStereo.num_window_levels",
               num_window_levels, "between 1 and 4")
      .message();
}

std::string FilterOptions::Check() const {
  return Rules()
      .Require(min_num_consistent >= 0 && min_num_consistent <= kMaxRequiredViews,
               "--PatchMatchStereo.filter_min_num_consistent", min_num_consistent,
               "between 0 and 255 source views")
      .Require(min_num_consistent_inferred >= 0 && min_num_consistent_inferred <= kMaxRequiredViews,
               "--PhiInference.min_num_consistent", min_num_consistent_inferred,
               "between 0 and 255 source views")
      .Require(max_reprojection_error > 0, "--PatchMatchStereo.filter_geom_consistency_max_cost",
               max_reprojection_error, "more than 0 pixels")
      .Require(max_relative_depth_error > 0 && max_relative_depth_error < 1,
               "--PhiStereo.filter_max_relative_depth_error", max_relative_depth_error, "in (0, 1)")
      .Require(max_depth_error >= 0, "--PhiStereo.filter_max_depth_error", max_depth_error,
               "0 (off) or more world units")
      .Require(max_normal_error > 0 && max_normal_error <= 180, "--PhiStereo.filter_max_normal_error",
               max_normal_error, "in (0, 180] degrees")
      .Require(min_triangulation_angle >= 0 && min_triangulation_angle < 90,
               "--PatchMatchStereo.filter_min_triangulation_angle", min_triangulation_angle,
               "in [0, 90) degrees")
      .message();
}

std::string InferenceOptions::Check() const {
  return Rules()
      .Require(num_passes >= 1 && num_passes <= 1000, "--PhiInference.num_passes", num_passes,
               "between 1 and 1000")
      .Require(kappa1 > 0, "kappa1", kappa1, "positive")
      .Require(kappa2 > 0, "kappa2", kappa2, "positive")
      .Require(truncation > 0 && truncation <= 1, "--PhiInference.truncation", truncation, "in (0, 1]")
      .Require(kappa3 > truncation, "kappa3", kappa3, "more than the truncation")
      .message();
}

}  // namespace phi
