#include "colmap_ext/map_scale.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/measurement_file.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// Units, and models that were scaled, are hardly ever nearer; half of the depths at sparse points, where a photo has texture, are
// hardly ever so wrong.
constexpr double kLargest = 1.25, kSmallest = 0.8;
// The median of fewer is moved by what a few lie behind.
constexpr std::size_t kFewestRatios = 50;
constexpr std::size_t kMostImages = 8, kMostPoints = 1000;  // of an image
constexpr int kSide = 256;                                  // of a map, thinned: a few megabytes are read of a large one
// The middle half of the ratios of right maps in another unit lies closer together; of maps that are noise it does not.
constexpr double kSpreadOfUnits = 1.25;

struct SampledImage {
  int image = 0;
  std::uint32_t image_id = 0;
  std::string_view kind;
  std::vector<Eigen::Vector3d> points = {};
};

// The first image with a map of each of kMostImages parts of the list.
std::vector<SampledImage> ChooseImages(const Workspace& workspace, const std::vector<std::string_view>& kinds) {
  std::vector<SampledImage> chosen;
  const std::size_t count = workspace.views().size();
  for (std::size_t part = 0; part < kMostImages; ++part) {
    for (std::size_t i = part * count / kMostImages; i < (part + 1) * count / kMostImages; ++i) {
      const int image = static_cast<int>(i);
      const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](std::string_view k) { return HasMap(workspace, image, k); });
      if (kind == kinds.end()) continue;
      chosen.push_back({image, workspace.views()[i].image_id, *kind});
      break;
    }
  }
  return chosen;
}

// As many of each image as tell.
void AddPointsTo(const Workspace& workspace, std::vector<SampledImage>* images) {
  std::size_t num_open = images->size();
  for (const SparsePoint& point : workspace.model().points) {
    for (const TrackElement& element : point.track) {
      for (SampledImage& sampled : *images) {
        if (sampled.image_id != element.image_id || sampled.points.size() == kMostPoints) continue;
        sampled.points.push_back(point.xyz);
        if (sampled.points.size() == kMostPoints) --num_open;
      }
    }
    if (num_open == 0) return;
  }
}

phi::DepthMap ReadSampledDepths(const Workspace& workspace, const SampledImage& sampled) {
  if (fs::exists(CompactMapPath(workspace, sampled.image, sampled.kind)))
    return FindPublishedDepths(workspace, sampled.image, sampled.kind)->depths;
  return ReadThinnedDepthMap(workspace.DepthMapPath(sampled.image, sampled.kind), kSide);
}

// Of the map's depths to the points'.
void AddRatios(const Workspace& workspace, const SampledImage& sampled, std::vector<double>* ratios) {
  if (sampled.points.empty()) return;
  const phi::DepthMap depths = ReadSampledDepths(workspace, sampled);
  const phi::Camera& camera = workspace.views()[static_cast<std::size_t>(sampled.image)].camera;
  const phi::Pinhole& k = camera.pinhole;
  for (const Eigen::Vector3d& point : sampled.points) {
    const Eigen::Vector3d p = camera.pose * point;
    if (!(p.z() > 0)) continue;
    const double x = (k.fx * p.x() / p.z() + k.cx) / k.width * depths.width();
    const double y = (k.fy * p.y() / p.z() + k.cy) / k.height * depths.height();
    if (!(x >= 0 && x < depths.width() && y >= 0 && y < depths.height())) continue;
    const float depth = depths(static_cast<int>(x), static_cast<int>(y));
    if (depth > 0 && std::isfinite(depth)) ratios->push_back(depth / p.z());
  }
}

// To two digits: what is measured tells no more.
double Rounded(double value) {
  const double step = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return std::round(value / step) * step;
}

phi::Message DescribeScale(const fs::path& first, std::size_t num_images, std::size_t num_points, double ratio) {
  return phi::AboutFile(first) +
         FormatText(": depths of maps are not those of the sparse model: at %zu of its points, in %zu images looked at, they are %.4g "
                    "times the points' depths; they are in another unit, or the model was scaled: multiply the maps by about %.6g, or "
                    "make them again",
                    num_points, num_images, ratio, Rounded(1 / ratio));
}

}  // namespace

phi::Message MapScaleWarning(const Workspace& workspace, const std::vector<std::string_view>& kinds) {
  try {
    std::vector<SampledImage> images = ChooseImages(workspace, kinds);
    AddPointsTo(workspace, &images);
    std::vector<double> ratios;
    for (const SampledImage& sampled : images) {
      try {
        AddRatios(workspace, sampled, &ratios);
      } catch (const std::exception&) {
        // told where the map is used
      }
    }
    if (ratios.size() < kFewestRatios) return "";
    std::sort(ratios.begin(), ratios.end());
    const double middle = ratios[ratios.size() / 2];
    const double low = ratios[ratios.size() / 4], high = ratios[ratios.size() - 1 - ratios.size() / 4];
    if ((middle >= kSmallest && middle <= kLargest) || high > kSpreadOfUnits * low) return "";
    return DescribeScale(workspace.DepthMapPath(images.front().image, images.front().kind), images.size(), ratios.size(), middle);
  } catch (const std::exception&) {
    return "";
  }
}

void WarnOfMapScale(const Workspace& workspace, const std::vector<std::string_view>& kinds) {
  const phi::Message warning = MapScaleWarning(workspace, kinds);
  if (!warning.empty()) phi::LogWarning(warning);
}

}  // namespace colmap_ext
