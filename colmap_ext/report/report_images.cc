#include "colmap_ext/report/report_images.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/map_statistics.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/progress.h"
#include "colmap_ext/report/report_pictures.h"
#include "colmap_ext/thinning.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using DepthMap = phi::Array2D<float>;
using TruthFiles = std::map<std::string, std::filesystem::path>;

// Of images without pictures: some thousands of large maps are terabytes, and shares and percentiles hardly change.
constexpr int kRowsForFigures = 256;

double ValidPercent(const DepthMap& depth) {
  if (depth.empty()) return 0;
  const auto valid = std::count_if(depth.begin(), depth.end(), [](float d) { return d > 0; });
  return 100.0 * static_cast<double>(valid) / static_cast<double>(depth.size());
}

// Pixels of a map of `height` rows, of which these are some, by floor(8 log2(depth)).
std::map<int, std::int64_t> DepthHistogram(const DepthMap& depth, int height) {
  constexpr int kBinsPerOctave = 8, kLowest = -150 * kBinsPerOctave, kEnd = 129 * kBinsPerOctave;  // of all floats
  std::array<float, kBinsPerOctave> bins{};  // where they begin, of the octave from 0.5 to 1
  for (int k = 0; k < kBinsPerOctave; ++k) bins[k] = std::exp2(static_cast<float>(k) / kBinsPerOctave - 1);
  std::vector<std::int64_t> counts(kEnd - kLowest);
  for (const float d : depth) {
    if (!(d > 0) || !std::isfinite(d)) continue;
    int exponent = 0;
    const float mantissa = std::frexp(d, &exponent);
    int bin = (exponent - 1) * kBinsPerOctave - 1;
    for (const float begin : bins) bin += mantissa >= begin;
    ++counts[bin - kLowest];
  }
  std::map<int, std::int64_t> histogram;
  for (int bin = kLowest; bin < kEnd; ++bin) {
    if (counts[bin - kLowest] > 0) histogram[bin] = counts[bin - kLowest] * height / depth.height();
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
    DoAll({[&](Part* part) { photometric_ = ReadDepths(kPhotometric, part); },
           [&](Part* part) { measured_ = ReadDepths(kMeasured, part); },
           [&](Part* part) { geometric_ = ReadDepths(kGeometric, part); },
           [&](Part* part) { filled_ = Read(workspace_.FilledMaskPath(image_), ReadMaskImage, part); }});
    if (!photometric_ && !geometric_) result_.warnings.push_back("has no depth map");
    if (Best()) {
      result_.width = Best()->depths.width();
      result_.height = Best()->map_height;
    }
    DoAll({[&](Part*) { AddShares(); }, [&](Part*) { AddDepths(); }, [&](Part*) { AddHistogram(); },
           [&](Part* part) { AddPhoto(part); }});
    if (with_pictures_ && Best()) AddPictures();
    return std::move(result_);
  }

 private:
  // What a step adds to the result's.
  struct Part {
    std::vector<ReportPicture> pictures;
    std::vector<std::string> warnings;

    void Add(const std::string& title, std::string uri, const std::string& caption, ReportLegend legend = {}) {
      pictures.push_back({title, std::move(uri), caption, std::move(legend)});
    }
  };
  using Steps = std::vector<std::function<void(Part*)>>;

  // Side by side, since one large image would be waited for; their parts come in order.
  void DoAll(const Steps& steps) {
    std::vector<Part> parts(steps.size());
    tbb::parallel_for(std::size_t{0}, steps.size(), [&](std::size_t i) { steps[i](&parts[i]); });
    for (Part& part : parts) {
      std::move(part.pictures.begin(), part.pictures.end(), std::back_inserter(result_.pictures));
      std::move(part.warnings.begin(), part.warnings.end(), std::back_inserter(result_.warnings));
    }
  }

  static phi::Mask ReadMaskImage(const std::filesystem::path& path) { return ReadGrayImage(path); }

  // None when the file is not there; a damaged file becomes a warning.
  template <typename Reader>
  auto Read(const std::filesystem::path& path, Reader read, Part* part) -> std::optional<decltype(read(path))> {
    if (!std::filesystem::exists(path)) return std::nullopt;
    try {
      return read(path);
    } catch (const phi::InputError& error) {
      part->warnings.push_back(error.what());
      return std::nullopt;
    }
  }

  // Of a map in whatever form.
  std::optional<DepthRows> ReadDepths(std::string_view kind, Part* part) {
    try {
      return FindPublishedDepths(workspace_, image_, kind, with_pictures_ ? kAllRows : kRowsForFigures);
    } catch (const phi::InputError& error) {
      part->warnings.push_back(error.what());
      return std::nullopt;
    }
  }

  const std::optional<DepthRows>& Best() const { return geometric_ ? geometric_ : measured_ ? measured_ : photometric_; }

  static double FilledPercent(const DepthMap& depth, int height, const phi::Mask& filled) {
    if (filled.width() != depth.width() || filled.height() != height) return -1;
    std::int64_t count = 0;
    for (int y = 0; y < depth.height(); ++y) {
      const int row = NearestPixel(y, depth.height(), height);
      for (int x = 0; x < depth.width(); ++x) count += depth(x, y) > 0 && filled(x, row) > 0;
    }
    return 100.0 * static_cast<double>(count) / static_cast<double>(depth.size());
  }

  void AddShares() {
    if (photometric_) result_.photometric = ValidPercent(photometric_->depths);
    if (measured_) result_.measured = ValidPercent(measured_->depths);
    if (geometric_) result_.geometric = ValidPercent(geometric_->depths);
    if (geometric_ && filled_) result_.filled = FilledPercent(geometric_->depths, geometric_->map_height, *filled_);
  }

  void AddDepths() {
    if (!Best()) return;
    const DepthMap& depth = Best()->depths;
    const MapStatistics statistics = DepthStatistics(depth);
    if (statistics.num_valid == 0) return;
    result_.near_depth = statistics.low;
    result_.median_depth = statistics.median;
    result_.far_depth = statistics.high;
    const phi::Pinhole& camera = workspace_.views()[image_].camera.pinhole;
    result_.pixel_size = statistics.median / (camera.fx * depth.width() / camera.width);
  }

  void AddHistogram() {
    if (Best()) result_.depth_histogram = DepthHistogram(Best()->depths, Best()->map_height);
  }

  void AddPhoto(Part* part) {
    if (!with_pictures_) return;
    std::error_code unreachable;
    if (!std::filesystem::exists(workspace_.ImagePath(image_), unreachable)) {
      part->warnings.push_back("its photo is missing");
      return;
    }
    try {
      part->Add("Input", PhotoPicture(workspace_.ImagePath(image_).string(), options_.picture_size), "undistorted photo");
    } catch (const phi::InputError& error) {
      part->warnings.push_back(error.what());
    }
  }

  void AddPictures() {
    // One range for all depths of the image, so that equal colours are equal depths.
    const DepthRange range{static_cast<float>(result_.near_depth), static_cast<float>(result_.far_depth)};
    const auto add_depth = [&](const char* title, const std::optional<DepthRows>& rows, const char* caption, Part* part) {
      if (rows) part->Add(title, DepthPicture(rows->depths, range, options_.picture_size), caption, DepthLegend(range));
    };
    DoAll({[&](Part* part) { add_depth("Raw depth", photometric_, "estimated, before the filter", part); },
           [&](Part* part) { add_depth("Measured depth", measured_, "confirmed by other views; black: none", part); },
           [&](Part* part) { add_depth("Final depth", geometric_, "measured and inferred; black: none", part); },
           [&](Part* part) { AddNormals(part); },
           [&](Part* part) { AddConfidence(part); },
           [&](Part* part) { AddCost(part); },
           [&](Part* part) { AddMasks(part); },
           [&](Part* part) { AddDifferenceToTruth(part); },
           [&](Part* part) { AddOther(range, part); }});
  }

  void AddNormals(Part* part) {
    const int side = options_.picture_size;
    const auto normals = Read(workspace_.NormalMapPath(image_, geometric_ ? kGeometric : kPhotometric),
                              [&](const auto& path) { return ReadThinnedNormalMap(path, side); }, part);
    if (normals) part->Add("Normals", NormalPicture(*normals, side), "red right, green up, blue towards the camera");
  }

  void AddCost(Part* part) {
    const int side = options_.picture_size;
    const auto cost = Read(workspace_.CostMapPath(image_, kPhotometric),
                           [&](const auto& path) { return ReadThinnedDepthMap(path, side); }, part);
    if (cost) part->Add("Matching cost", CostPicture(*cost, side), "1 - ZNCC of the window", {"inferno", "0 alike", "2 unlike"});
  }

  void AddConfidence(Part* part) {
    const int side = options_.picture_size;
    const auto confidence = Read(workspace_.ConfidenceMapPath(image_, kGeometric),
                                 [&](const auto& path) { return ReadThinnedDepthMap(path, side); }, part);
    if (confidence) {
      part->Add("Confidence", ConfidencePicture(*confidence, side), "how probably the final depth is right; black: none",
                {"viridis", "0", "100 %"});
    }
  }

  void AddMasks(Part* part) {
    const int side = options_.picture_size;
    if (const auto mask = workspace_.ImageMaskPath(image_); !mask.empty()) {
      const auto left_out = Read(mask, ReadMaskImage, part);
      if (left_out) part->Add("Mask", MaskPicture(*left_out, side), "black: left out of the reconstruction");
    }
    if (filled_) part->Add("Filled mask", MaskPicture(*filled_, side), "white: inferred, not measured");
  }

  static constexpr const char* kDifferenceCaption = "grey: not in both";

  void AddDifferenceToTruth(Part* part) {
    const auto file = truth_.find(result_.name);
    if (file == truth_.end()) return;
    const auto truth = Read(
        file->second, [&](const std::filesystem::path& p) { return ReadTruthDepth(p, options_.values_per_unit); }, part);
    if (!truth) return;
    RequireShapeOfImage(*truth, file->second, workspace_.views()[image_]);
    part->Add("Difference to truth", DifferencePicture(Best()->depths, *truth, options_.picture_size), kDifferenceCaption,
              DifferenceLegend());
  }

  // The other program's map.
  void AddOther(DepthRange range, Part* part) {
    if (options_.compare_workspace.empty()) return;
    const auto other = Read(options_.compare_workspace / "stereo" / "depth_maps" / (result_.name + ".geometric.bin"),
                            ReadDepthMap, part);
    if (!other) {
      part->warnings.push_back("has no geometric depth map in " + options_.compare_workspace.string());
      return;
    }
    part->Add("Depth, " + options_.compare_name, DepthPicture(*other, range, options_.picture_size),
              "same colours as the final depth", DepthLegend(range));
    part->Add("Difference to " + options_.compare_name, DifferencePicture(Best()->depths, *other, options_.picture_size),
              kDifferenceCaption, DifferenceLegend());
  }

  const Workspace& workspace_;
  const ReportOptions& options_;
  const TruthFiles& truth_;
  int image_;
  bool with_pictures_;
  std::optional<DepthRows> photometric_, measured_, geometric_;
  std::optional<phi::Mask> filled_;
  ReportImage result_;
};

}  // namespace

std::vector<ReportImage> MakeReportImages(const Workspace& workspace, const ReportOptions& options) {
  const TruthFiles truth =
      options.truth_depth_maps.empty() ? TruthFiles() : FindTruthMapsOf(workspace, options.truth_depth_maps);
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
