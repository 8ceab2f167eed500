#include "phi/fusion/fusion_options.h"

#include <sstream>

namespace phi {
namespace {

template <typename T>
void Require(bool holds, const char* option, const T& value, const char* rule, std::string* message) {
  if (holds || !message->empty()) return;
  std::ostringstream out;
  out << option << " is " << value << ", but must be " << rule;
  *message = out.str();
}

}  // namespace

std::string FusionOptions::Check() const {
  std::string message;
  Require(min_num_views >= 1, "--StereoFusion.min_num_pixels", min_num_views, "at least 1", &message);
  Require(max_num_views >= min_num_views, "--StereoFusion.max_num_pixels", max_num_views,
          "at least --StereoFusion.min_num_pixels", &message);
  Require(max_reproj_error > 0, "--StereoFusion.max_reproj_error", max_reproj_error, "positive (pixels)",
          &message);
  Require(max_depth_error > 0 && max_depth_error < 0.5, "--StereoFusion.max_depth_error", max_depth_error,
          "in (0, 0.5) (difference over depth)", &message);
  Require(max_normal_error > 0 && max_normal_error <= 90, "--StereoFusion.max_normal_error", max_normal_error,
          "in (0, 90] degrees", &message);
  Require(max_normal_error_in_holes >= 0 && max_normal_error_in_holes <= 90,
          "--PhiFusion.max_normal_error_in_holes", max_normal_error_in_holes, "in [0, 90] degrees", &message);
  Require(min_support >= 0, "--PhiFusion.min_support", min_support, "at least 0", &message);
  Require(min_support_inferred >= 0, "--PhiFusion.min_support_inferred", min_support_inferred, "at least 0",
          &message);
  Require(max_conflicts >= 0, "--PhiFusion.max_conflicts", max_conflicts, "at least 0", &message);
  return message;
}

}  // namespace phi
