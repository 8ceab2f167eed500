// confidence_table WORKSPACE TRUTH_DEPTH_MAPS VALUES_PER_UNIT COVERED OUTPUT
//
// The table that scripts/fit_confidence fits the model of phi/filtering/confidence_terms.h to. For pixels of the workspace's photometric
// maps, every fourth of every fourth row: the terms, and 1 where the depth is right, 0 where not; little-endian floats, row by row.
// COVERED 1: pixels without truth are no surface (rendered scenes), 0: the truth has gaps there, which are left out.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <vector>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/workspace.h"
#include "phi/base/error.h"
#include "phi/base/image_noise.h"
#include "phi/cpu/cpu_filter.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/own_texture.h"
#include "phi/geometry/depth_precision.h"

namespace {

using colmap_ext::ImageJob;
using colmap_ext::Workspace;

constexpr int kStride = 4;  // pixels
constexpr float kRightShare = 0.005f, kRightDeviations = 2;

// Distance of a point from the true surface over its difference in depth: the truth's own slant at the pixel.
float SlantFactor(const phi::Array2D<float>& truth, const phi::Pinhole& k, int x, int y) {
  const auto point = [&](int u, int v) {
    const float z = truth(u, v);
    return phi::Vec3f{z * static_cast<float>((u + 0.5 - k.cx) / k.fx), z * static_cast<float>((v + 0.5 - k.cy) / k.fy), z};
  };
  if (x < 1 || y < 1 || x + 1 >= truth.width() || y + 1 >= truth.height()) return 1;
  const phi::Vec3f normal = Cross(point(x + 1, y) - point(x - 1, y), point(x, y + 1) - point(x, y - 1));
  const phi::Vec3f p = point(x, y);
  const float length = Norm(normal);
  return length > 0 ? std::fabs(Dot(normal, p)) / (length * p.z) : 1;
}

class Table {
 public:
  Table(const Workspace& workspace, const std::vector<ImageJob>& jobs, double values_per_unit, bool is_covered)
      : workspace_(workspace), jobs_(jobs), values_per_unit_(values_per_unit), is_covered_(is_covered) {
    for (int image = 0; image < static_cast<int>(workspace.views().size()); ++image) {
      const bool has_map = std::filesystem::exists(workspace.DepthMapPath(image, colmap_ext::kPhotometric));
      maps_.push_back(has_map ? std::make_shared<const phi::MeasurementMap>(
                                    ReadMeasurements(workspace, image, colmap_ext::kPhotometric))
                              : nullptr);
    }
  }

  void Add(const ImageJob& job, const std::filesystem::path& truth_path, std::ofstream* out) const {
    if (maps_[job.image] == nullptr) return;
    const phi::SceneView& view = workspace_.views()[job.image];
    phi::FilterInput input;
    input.reference = {&view, maps_[job.image]};
    std::vector<const phi::Camera*> cameras;
    for (const int source : job.sources) {
      if (maps_[source] == nullptr) continue;
      input.sources.push_back({&workspace_.views()[source], [map = maps_[source]] { return map; }});
      if (cameras.size() < job.NumMatched()) cameras.push_back(&workspace_.views()[source].camera);
    }
    const phi::DepthPrecision precision(view.camera, cameras);
    phi::Array2D<phi::Testimonies> testimonies;
    phi::FilterOnCpu(input, phi::FilterOptions(), &testimonies);
    const phi::Array2D<float> truth = colmap_ext::ReadTruthDepth(truth_path, values_per_unit_);
    const std::shared_ptr<const phi::GrayImage> photo = workspace_.ReadGray(job.image);
    const double noise = phi::NoiseDeviation(photo->view());
    const phi::PlaneMap& estimate = maps_[job.image]->planes;
    phi::Pinhole k = view.camera.pinhole;
    const double scale = static_cast<double>(truth.width()) / estimate.width();
    for (double* value : {&k.fx, &k.fy, &k.cx, &k.cy}) *value *= scale;
    std::mutex mutex;
    std::vector<float> rows;
    phi::Mask sample(estimate.width(), estimate.height(), 0);
    for (int y = 0; y < sample.height(); y += kStride) {
      for (int x = 0; x < sample.width(); x += kStride) sample(x, y) = 255;
    }
    const phi::Array2D<float> deviations = precision.RelativeDeviations(estimate, sample);
    const phi::OwnTexture texture = phi::FindOwnTexture(*photo, noise);
    phi::ForConfidenceTerms({precision.reference(), estimate, testimonies, sample, deviations, texture.variance, noise},
                            [&](int x, int y, const phi::ConfidenceTerms& terms) {
                              const int u = static_cast<int>((x + 0.5) * scale), v = static_cast<int>((y + 0.5) * scale);
                              if (u >= truth.width() || v >= truth.height()) return;
                              const float z = truth(u, v), depth = estimate(x, y).depth;
                              if (!(z > 0) && !is_covered_) return;
                              const float deviation = deviations(x, y);
                              const bool right = z > 0 && std::fabs(depth - z) * SlantFactor(truth, k, u, v) <
                                                              std::fmax(kRightShare, kRightDeviations * deviation) * z;
                              const std::lock_guard<std::mutex> lock(mutex);
                              rows.insert(rows.end(), terms.begin(), terms.end());
                              rows.push_back(right);
                            });
    out->write(reinterpret_cast<const char*>(rows.data()), static_cast<std::streamsize>(rows.size() * sizeof(float)));
  }

 private:
  const Workspace& workspace_;
  const std::vector<ImageJob>& jobs_;
  double values_per_unit_;
  bool is_covered_;
  std::vector<std::shared_ptr<const phi::MeasurementMap>> maps_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fputs("usage: confidence_table WORKSPACE TRUTH_DEPTH_MAPS VALUES_PER_UNIT COVERED OUTPUT\n", stderr);
    return 2;
  }
  try {
    const Workspace workspace({.path = argv[1]});
    const std::vector<ImageJob> jobs =
        MakeImageJobs(workspace, colmap_ext::MakeSparseScene(workspace.model()), {}, phi::ViewSelectionOptions());
    const auto truth = colmap_ext::FindTruthMaps(argv[2]);
    const Table table(workspace, jobs, std::atof(argv[3]), argv[4][0] == '1');
    std::ofstream out(argv[5], std::ios::binary);
    for (const ImageJob& job : jobs) {
      const auto of_image = truth.find(workspace.views()[job.image].name);
      if (job.problem.empty() && of_image != truth.end()) table.Add(job, of_image->second, &out);
    }
    return out.flush() ? 0 : 3;
  } catch (const phi::Error& error) {
    std::fprintf(stderr, "confidence_table: %s\n", error.what());
    return 1;
  }
}
