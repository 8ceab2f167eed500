// hypothesis_table WORKSPACE TRUTH_DEPTH_MAPS VALUES_PER_UNIT COVERED [MAX_IMAGE_SIZE [RIGHT]]
//
// What became of the holes of a finished run (measured and geometric maps), against true depths: was a right hypothesis offered, and
// what was chosen; regions offer what they choose first. One line an image and one in all; shares of the holes in percent. COVERED as confidence_table's.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/workspace.h"
#include "phi/backend.h"
#include "phi/base/error.h"
#include "tests/support/region_hypotheses.h"

namespace {

using colmap_ext::ImageJob;
using colmap_ext::Workspace;

constexpr float kDefaultRight = 0.01f;  // relative

// Where a hole lies, and what is offered there.
enum Offer { kRegionRight, kOnlyLinesRight, kRegionWrong, kOnlyLinesWrong, kNothing, kNumOffers };
enum Fate { kFilledRight, kFilledWrong, kOpen, kNumFates };
constexpr const char* kOffers[] = {"region right", "only lines right", "region wrong", "lines wrong",
                                   "nothing"};

struct Counts {
  std::array<std::array<std::int64_t, kNumFates>, kNumOffers> holes{};
  std::array<std::int64_t, kNumFates> no_truth{};
  std::int64_t pixels = 0, measured = 0, measured_right = 0;

  void Add(const Counts& other) {
    for (int i = 0; i < kNumOffers; ++i)
      for (int j = 0; j < kNumFates; ++j) holes[i][j] += other.holes[i][j];
    for (int j = 0; j < kNumFates; ++j) no_truth[j] += other.no_truth[j];
    pixels += other.pixels, measured += other.measured, measured_right += other.measured_right;
  }

  void Print(const std::string& name) const {
    std::printf("%s: measured %.1f %% of pixels, of these right %.1f %%\n", name.c_str(),
                100.0 * measured / pixels, 100.0 * measured_right / std::max<std::int64_t>(measured, 1));
    for (int i = 0; i < kNumOffers; ++i) {
      std::printf("  %-17s right %5.2f  wrong %5.2f  open %5.2f   (%% of all pixels)\n", kOffers[i],
                  100.0 * holes[i][0] / pixels, 100.0 * holes[i][1] / pixels, 100.0 * holes[i][2] / pixels);
    }
    std::printf("  %-17s             wrong %5.2f  open %5.2f\n", "no surface", 100.0 * no_truth[1] / pixels,
                100.0 * no_truth[2] / pixels);
  }
};

class Table {
 public:
  Table(const Workspace& workspace, double values_per_unit, bool is_covered, float right)
      : workspace_(workspace), values_per_unit_(values_per_unit), is_covered_(is_covered), right_(right) {
    for (int image = 0; image < static_cast<int>(workspace.views().size()); ++image) {
      maps_.push_back(std::make_shared<const phi::MeasurementMap>(
          ReadMeasurements(workspace, image, colmap_ext::kMeasured)));
      depths_.push_back(std::make_shared<const phi::MeasuredDepths>(DepthsOf(*maps_.back())));
    }
  }

  Counts Count(const ImageJob& job, const std::filesystem::path& truth_path) const {
    phi::InferenceInput input;
    input.reference = View(job.image);
    input.measured = maps_[job.image];
    for (const int source : job.sources) {
      if (input.sources.size() >= phi::kMaxSourceViews) break;
      input.sources.push_back(View(source));
      input.source_depths.push_back(depths_[source]);
    }
    const phi::Hypotheses hypotheses =
        phi::RegionHypotheses(*input.measured, phi::Rules(), *input.reference.image, RegionsOf(input, phi::Rules()),
                              input.reference.view->image_id, GatherPlaneEvidence(input, phi::Rules()));
    const phi::MeasurementMap finished = ReadMeasurements(workspace_, job.image, colmap_ext::kGeometric);
    const phi::Array2D<float> truth = colmap_ext::ReadTruthDepth(truth_path, values_per_unit_);
    const double scale = static_cast<double>(truth.width()) / finished.width();
    const phi::HypothesisState state = hypotheses.state();
    Counts counts;
    for (int y = 0; y < finished.height(); ++y) {
      for (int x = 0; x < finished.width(); ++x) {
        const int u = static_cast<int>((x + 0.5) * scale), v = static_cast<int>((y + 0.5) * scale);
        const float z = truth(u, v), depth = finished.planes(x, y).depth;
        if (!(z > 0) && !is_covered_) continue;
        ++counts.pixels;
        const Fate fate = !(depth > 0) ? kOpen : z > 0 && IsRight(depth, z) ? kFilledRight : kFilledWrong;
        if (IsMeasured(input.measured->states(x, y))) {
          ++counts.measured;
          counts.measured_right += fate == kFilledRight;
          continue;
        }
        if (!(z > 0)) {
          ++counts.no_truth[fate];
          continue;
        }
        bool region = false, line = false, region_right = false, line_right = false;
        for (int k = 0; k < phi::kNumDirections; ++k) {
          const float w = state.maps.inverse_depth[k](x, y);
          if (!(w > 0)) continue;
          const bool from_region = state.FromRegion(x, y) >> k & 1;
          (from_region ? region : line) = true;
          if (IsRight(1 / w, z)) (from_region ? region_right : line_right) = true;
        }
        const Offer offer = region_right ? kRegionRight
                            : line_right ? kOnlyLinesRight
                            : region     ? kRegionWrong
                            : line       ? kOnlyLinesWrong
                                         : kNothing;
        ++counts.holes[offer][fate];
      }
    }
    return counts;
  }

 private:
  bool IsRight(float depth, float truth) const {
    return depth > 0 && std::fabs(depth - truth) < right_ * truth;
  }

  phi::ViewImage View(int image) const { return {&workspace_.views()[image], workspace_.ReadGray(image)}; }

  const Workspace& workspace_;
  double values_per_unit_;
  bool is_covered_;
  float right_;
  std::vector<std::shared_ptr<const phi::MeasurementMap>> maps_;
  std::vector<std::shared_ptr<const phi::MeasuredDepths>> depths_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5 || argc > 7) {
    std::fputs(
        "usage: hypothesis_table WORKSPACE TRUTH_DEPTH_MAPS VALUES_PER_UNIT COVERED [MAX_IMAGE_SIZE "
        "[RIGHT]]\n",
        stderr);
    return 2;
  }
  try {
    const Workspace workspace({.path = argv[1], .max_image_size = argc > 5 ? std::atoi(argv[5]) : -1});
    const std::vector<ImageJob> jobs = MakeImageJobs(
        workspace, colmap_ext::MakeSparseScene(workspace.model()), {}, phi::ViewSelectionOptions());
    const auto truth = colmap_ext::FindTruthMaps(argv[2]);
    const Table table(workspace, std::atof(argv[3]), argv[4][0] == '1',
                      argc > 6 ? static_cast<float>(std::atof(argv[6])) : kDefaultRight);
    Counts all;
    for (const ImageJob& job : jobs) {
      const auto of_image = truth.find(workspace.views()[job.image].name);
      if (!job.problem.empty() || of_image == truth.end()) continue;
      const Counts counts = table.Count(job, of_image->second);
      counts.Print(workspace.views()[job.image].name);
      all.Add(counts);
    }
    all.Print("all");
    return 0;
  } catch (const phi::Error& error) {
    std::fprintf(stderr, "hypothesis_table: %s\n", error.what());
    return 1;
  }
}
