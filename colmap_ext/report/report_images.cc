#include "colmap_ext/report/report_images.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/map_statistics.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/progress.h"
#include "colmap_ext/report/report_pictures.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using DepthMap = phi::Array2D<float>;
using TruthFiles = std::map<std::string, std::filesystem::path>;

double ValidPercent(const DepthMap& depth) {
  if (depth.empty()) return 0;
  const auto valid = std::count_if(depth.begin(), depth.end(), [](float d) { return d > 0; });
  return 100.0 * static_cast<double>(valid) / static_cast<double>(depth.size());
}

// Pixels by floor(8 log2(depth)).
std::map<int, std::int64_t> DepthHistogram(const DepthMap& depth) {
  constexpr int kBinsPerOctave = 8, kLowest = -150 * kBinsPerOctave, kEnd = 129 * kBinsPerOctave;  // of all floats
  std::vector<std::int64_t> counts(kEnd - kLowest);
  for (const float d : depth) {
    if (d > 0 && std::isfinite(d)) ++counts[static_cast<int>(std::floor(kBinsPerOctave * std::log2(d))) - kLowest];
  }
  std::map<int, std::int64_t> histogram;
  for (int bin = kLowest; bin < kEnd; ++bin) {
    if (counts[bin - kLowest] > 0) histogram[bin] = counts[bin - kLowest];
  }
  return histogram;
}

std::string Number(double value) { return FormatText("%.4g", value); }

// Near is warm.
ReportLegend DepthLegend(DepthRange range) {
  if (!(range.upper > 0)) return {};
  return {"turbo", Number(range.upper) + " far", Number(range.lower) + " near, world units"};
}

ReportLegend DifferenceLegend() { return {"viridis", "0", Number(100 * kMaxRelativeDifference) + " % of the depth or more"}; }

class ImageMaker {
 public:
  ImageMaker(const Workspace& workspace, const ReportOptions& options, const TruthFiles& truth, int image,
             bool with_pictures)
      : workspace_(workspace),
        options_(options),
        truth_(truth),
        image_(image),
        with_pictures_(with_pictures) {}

  ReportImage Make() {
    result_.name = workspace_.views()[image_].name;
    result_.view = image_;
    const auto photometric = ReadDepths(kPhotometric), measured = ReadDepths(kMeasured);
    const auto geometric = Read(workspace_.DepthMapPath(image_, kGeometric), ReadDepthMap);
    const auto filled =
        Read(workspace_.FilledMaskPath(image_), [](const auto& path) { return ReadGrayImage(path); });
    if (photometric) result_.photometric = ValidPercent(*photometric);
    if (measured) result_.measured = ValidPercent(*measured);
    if (geometric) result_.geometric = ValidPercent(*geometric);
    if (geometric && filled) result_.filled = FilledPercent(*geometric, *filled);
    if (!photometric && !geometric) result_.warnings.push_back("has no depth map");
    if (const auto& best = geometric ? geometric : measured ? measured : photometric; best) AddDepths(*best);
    if (with_pictures_) AddPictures(photometric, measured, geometric, filled);
    return std::move(result_);
  }

 private:
  // None when the file is not there; a damaged file becomes a warning.
  template <typename Reader>
  auto Read(const std::filesystem::path& path, Reader read) -> std::optional<decltype(read(path))> {
    if (!std::filesystem::exists(path)) return std::nullopt;
    try {
      return read(path);
    } catch (const phi::InputError& error) {
      result_.warnings.push_back(error.what());
      return std::nullopt;
    }
  }

  // Of a map in whatever form.
  std::optional<DepthMap> ReadDepths(std::string_view kind) {
    try {
      return FindPublishedDepths(workspace_, image_, kind);
    } catch (const phi::InputError& error) {
      result_.warnings.push_back(error.what());
      return std::nullopt;
    }
  }

  static double FilledPercent(const DepthMap& depth, const phi::Mask& filled) {
    if (filled.size() != depth.size()) return -1;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < depth.size(); ++i) count += depth.data()[i] > 0 && filled.data()[i] > 0;
    return 100.0 * static_cast<double>(count) / static_cast<double>(depth.size());
  }

  void Add(const std::string& title, std::string uri, const std::string& caption, ReportLegend legend = {}) {
    result_.pictures.push_back({title, std::move(uri), caption, std::move(legend)});
  }

  void AddDepths(const DepthMap& depth) {
    const MapStatistics statistics = DepthStatistics(depth);
    result_.width = depth.width();
    result_.height = depth.height();
    if (statistics.num_valid == 0) return;
    result_.near_depth = statistics.low;
    result_.median_depth = statistics.median;
    result_.far_depth = statistics.high;
    const phi::Pinhole& camera = workspace_.views()[image_].camera.pinhole;
    result_.pixel_size = statistics.median / (camera.fx * depth.width() / camera.width);
    result_.depth_histogram = DepthHistogram(depth);
  }

  void AddPictures(const std::optional<DepthMap>& photometric, const std::optional<DepthMap>& measured,
                   const std::optional<DepthMap>& geometric, const std::optional<phi::Mask>& filled) {
    const int side = options_.picture_size;
    std::error_code unreachable;
    if (std::filesystem::exists(workspace_.ImagePath(image_), unreachable)) {
      try {
        Add("Input", PhotoPicture(workspace_.ImagePath(image_).string(), side), "undistorted photo");
      } catch (const phi::InputError& error) {
        result_.warnings.push_back(error.what());
      }
    } else {
      result_.warnings.push_back("its photo is missing");
    }
    // One range for all depths of the image, so that equal colours are equal depths.
    const auto& best = geometric ? geometric : measured ? measured : photometric;
    if (!best) return;
    const DepthRange range{static_cast<float>(result_.near_depth), static_cast<float>(result_.far_depth)};
    const ReportLegend legend = DepthLegend(range);
    if (photometric)
      Add("Raw depth", DepthPicture(*photometric, range, side), "estimated, before the filter", legend);
    if (measured)
      Add("Measured depth", DepthPicture(*measured, range, side), "confirmed by other views; black: none",
          legend);
    if (geometric)
      Add("Final depth", DepthPicture(*geometric, range, side), "measured and inferred; black: none", legend);
    const auto normals = Read(workspace_.NormalMapPath(image_, geometric ? kGeometric : kPhotometric),
                              [&](const auto& path) { return ReadThinnedNormalMap(path, side); });
    if (normals)
      Add("Normals", NormalPicture(*normals, side), "red right, green up, blue towards the camera");
    const auto cost = Read(workspace_.CostMapPath(image_, kPhotometric),
                           [&](const auto& path) { return ReadThinnedDepthMap(path, side); });
    if (cost) Add("Matching cost", CostPicture(*cost, side), "1 - ZNCC of the window", {"inferno", "0 alike", "2 unlike"});
    if (const auto mask = workspace_.ImageMaskPath(image_); !mask.empty()) {
      const auto left_out = Read(mask, [](const auto& path) { return ReadGrayImage(path); });
      if (left_out) Add("Mask", MaskPicture(*left_out, side), "black: left out of the reconstruction");
    }
    if (filled) Add("Filled mask", MaskPicture(*filled, side), "white: inferred, not measured");
    AddDifferences(*best, range);
  }

  void AddDifferences(const DepthMap& depth, DepthRange range) {
    const std::string caption = "grey: not in both";
    if (const auto file = truth_.find(result_.name); file != truth_.end()) {
      const auto truth = Read(file->second, [&](const std::filesystem::path& p) {
        return ReadTruthDepth(p, options_.values_per_unit);
      });
      if (truth) Add("Difference to truth", DifferencePicture(depth, *truth, options_.picture_size), caption,
            DifferenceLegend());
    }
    if (options_.compare_workspace.empty()) return;
    const auto other =
        Read(options_.compare_workspace / "stereo" / "depth_maps" / (result_.name + ".geometric.bin"),
             ReadDepthMap);
    if (!other) {
      result_.warnings.push_back("has no geometric depth map in " + options_.compare_workspace.string());
      return;
    }
    Add("Depth, " + options_.compare_name,
        DepthPicture(*other, range, options_.picture_size),
        "same colours as the final depth", DepthLegend(range));
    Add("Difference to " + options_.compare_name, DifferencePicture(depth, *other, options_.picture_size),
        caption, DifferenceLegend());
  }

  const Workspace& workspace_;
  const ReportOptions& options_;
  const TruthFiles& truth_;
  int image_;
  bool with_pictures_;
  ReportImage result_;
};

}  // namespace

std::vector<ReportImage> MakeReportImages(const Workspace& workspace, const ReportOptions& options) {
  const TruthFiles truth =
      options.truth_depth_maps.empty() ? TruthFiles() : FindTruthMaps(options.truth_depth_maps);
  const std::size_t count = workspace.views().size();
  // Evenly over the sequence.
  const std::size_t step = std::max<std::size_t>(1, (count + options.max_images - 1) / options.max_images);
  std::vector<int> by_name(count);
  std::iota(by_name.begin(), by_name.end(), 0);
  std::sort(by_name.begin(), by_name.end(),
            [&](int a, int b) { return workspace.views()[a].name < workspace.views()[b].name; });
  std::vector<ReportImage> images(count);
  ProgressLine progress(ProgressStage{.name = "reading maps"}, count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    phi::ThrowIfCancelled();
    const ProgressLine::Task task(&progress);
    images[i] = ImageMaker(workspace, options, truth, by_name[i], i % step == 0).Make();
  });
  return images;
}

}  // namespace colmap_ext
