#include "colmap_ext/fusion/fusion_report.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "colmap_ext/format_text.h"
#include "colmap_ext/json_file.h"

namespace colmap_ext {
namespace {

using phi::PixelOutcome;

// Fewer pixels than this share of those with depth end in a point or under one: something is wrong.
constexpr double kFewShare = 0.05;

struct Reason {
  PixelOutcome outcome;
  const char* text;
  const char* cause;  // when it keeps most pixels from the cloud
};

constexpr Reason kReasons[] = {
    {PixelOutcome::kFused, "gave a point", ""},
    {PixelOutcome::kCovered, "covered by another image's point", ""},
    {PixelOutcome::kNoDepth, "no depth",
     "the maps are almost empty: was the stereo run on these images, did its filter leave anything, and do masks hide no more than they "
     "should?"},
    {PixelOutcome::kTooFewViews, "too few images see the spot and have depth there",
     "the images hardly overlap or few of them have maps: estimate more images, or lower "
     "--StereoFusion.min_num_pixels"},
    {PixelOutcome::kDepth, "depth differs between images",
     "the depth maps contradict each other: were they filtered (geometric consistency), and do they belong "
     "to this sparse "
     "model? --StereoFusion.max_depth_error is the tolerance"},
    {PixelOutcome::kReprojection, "reprojection error too large",
     "the maps agree less well than --StereoFusion.max_reproj_error asks: inaccurate poses, or maps of "
     "another image size"},
    {PixelOutcome::kNormal, "normals differ between images",
     "the normals contradict each other: raise --StereoFusion.max_normal_error, or check that the normal "
     "maps are in camera "
     "frames"},
    {PixelOutcome::kSeenThrough, "other images see through the point",
     "most points float before surfaces that other images see: the maps are unfiltered, or "
     "--PhiFusion.max_conflicts is too "
     "low"},
    {PixelOutcome::kWeakSupport, "enough images agree, but not closely",
     "the maps agree only just: lower --PhiFusion.min_support"},
    {PixelOutcome::kImprobable, "more probably wrong than --PhiFusion.min_confidence allows",
     "few images agree well: lower --PhiFusion.min_confidence"},
    {PixelOutcome::kOutsideBox, "outside the bounding box", ""},
};

}  // namespace

std::string OutcomeHistogram(const phi::OutcomeCounts& outcomes) {
  std::int64_t total = 0;
  std::vector<std::pair<std::int64_t, const char*>> rows;
  for (const Reason& reason : kReasons) {
    total += outcomes[reason.outcome];
    if (outcomes[reason.outcome] > 0) rows.emplace_back(outcomes[reason.outcome], reason.text);
  }
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (const auto& [count, reason] : rows) {
    text += FormatText("%s  %6.2f %%  %s", text.empty() ? "" : "\n",
                       100.0 * static_cast<double>(count) / static_cast<double>(total), reason);
  }
  return text;
}

std::string FusionJson(const SceneFusionReport& report, double seconds) {
  nlohmann::ordered_json pixels = nlohmann::ordered_json::object();
  for (const Reason& reason : kReasons) {
    if (report.outcomes[reason.outcome] > 0) pixels[reason.text] = report.outcomes[reason.outcome];
  }
  const nlohmann::ordered_json json = {{"version", PHIMVS_VERSION},
                                       {"points", report.num_points},
                                       {"images", report.num_images},
                                       {"images_without_maps", report.num_images_without_maps},
                                       {"seconds", seconds},
                                       {"pixels", pixels},
                                       {"smoothing", DescribeSmoothing(report)},
                                       {"advice", ExplainFewPoints(report)}};
  return DumpJson(json, 1) + "\n";
}

std::string DescribeSmoothing(const SceneFusionReport& report) {
  std::vector<double> noise = report.noise_of_smoothed_maps;
  if (noise.empty()) return "";
  std::sort(noise.begin(), noise.end());
  return FormatText(
      "%zu of %d maps were smoothed: their depths differ from pixel to pixel by %.2f %% (in the middle one), as those of small maps and "
      "of other programs do",
      noise.size(), report.num_images, 100 * noise[noise.size() / 2]);
}

std::string ExplainFewPoints(const SceneFusionReport& report) {
  const phi::OutcomeCounts& outcomes = report.outcomes;
  std::int64_t total = 0;
  for (const Reason& reason : kReasons) total += outcomes[reason.outcome];
  // What lies outside the box was found as well: a box may be for a small part of the scene.
  const double good = static_cast<double>(outcomes[PixelOutcome::kFused] + outcomes[PixelOutcome::kCovered] +
                                          outcomes[PixelOutcome::kOutsideBox]);
  const double with_depth = static_cast<double>(total - outcomes[PixelOutcome::kNoDepth]);
  const bool empty_maps = with_depth < kFewShare * static_cast<double>(total);
  if (!empty_maps && good >= kFewShare * with_depth) return "";
  if (report.num_images == 1) {
    return "only one image has maps, and a point needs the agreement of several: estimate more images, or "
           "set "
           "--StereoFusion.min_num_pixels 1";
  }
  const Reason* likely = &kReasons[2];
  for (const Reason& reason : kReasons) {
    if (empty_maps || *reason.cause == '\0' || reason.outcome == PixelOutcome::kNoDepth) continue;
    if (likely->outcome == PixelOutcome::kNoDepth || outcomes[reason.outcome] > outcomes[likely->outcome])
      likely = &reason;
  }
  return likely->cause;
}

}  // namespace colmap_ext
