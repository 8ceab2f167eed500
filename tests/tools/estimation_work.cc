// estimation_work WORKSPACE TRUTH VALUES_PER_UNIT SIZE SEEDS [EVERY [NAME=VALUE ...]]
//
// What an estimation costs and how good its raw depths are: every EVERYth image of a workspace, reduced to SIZE pixels, on one
// thread, for the seeds 0 to SEEDS - 1. Prints a line a seed: samples and hypotheses a pixel, processor seconds a megapixel, and
// the share of the pixels with truth whose depth is within 1 %, 0.3 % and 0.1 % of it. NAME=VALUE: options of the stereo.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/workspace.h"
#include "phi/backend.h"
#include "phi/base/error.h"
#include "phi/base/image_noise.h"
#include "phi/sparse_depth.h"

namespace {

struct Score {
  phi::EstimationCounts counts;
  double pixels = 0, seconds = 0, with_truth = 0, within[3] = {};
};

constexpr float kTolerances[3] = {0.01f, 0.003f, 0.001f};

double ProcessorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Truth may be larger than the maps: the pixel that holds the map pixel's centre counts.
void AddDepths(const phi::PlaneMap& map, const phi::Array2D<std::uint16_t>& truth, double values_per_unit, Score* score) {
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      const int tx = static_cast<int>((x + 0.5) * truth.width() / map.width());
      const int ty = static_cast<int>((y + 0.5) * truth.height() / map.height());
      const double z = truth(tx, ty) / values_per_unit;
      if (!(z > 0)) continue;
      ++score->with_truth;
      for (int k = 0; k < 3; ++k) score->within[k] += std::abs(map(x, y).depth - z) <= kTolerances[k] * z;
    }
  }
}

int Run(int argc, char** argv) {
  if (argc < 6) throw phi::UsageError("see the head of tests/tools/estimation_work.cc");
  const std::filesystem::path truth_folder = argv[2];
  const double values_per_unit = std::atof(argv[3]);
  const int num_seeds = std::atoi(argv[5]), every = argc > 6 ? std::atoi(argv[6]) : 1;
  phi::StereoOptions options;
  phi::OptionList list = options.List();
  for (int i = 7; i < argc; ++i) {
    const std::string text = argv[i];
    const std::size_t equals = text.find('=');
    phi::Option* option = list.Find(text.substr(0, equals));
    if (option == nullptr) throw phi::UsageError("no option " + text);
    option->Assign(text.substr(equals + 1));
  }
  const colmap_ext::Workspace workspace({.path = argv[1], .max_image_size = std::atoi(argv[4])});
  const phi::SparseScene scene = colmap_ext::MakeSparseScene(workspace.model());
  const phi::SparseDepthSource sparse_depth(workspace.views(), scene);
  const auto jobs = colmap_ext::ListImageJobs(workspace, scene, "", {});
  const auto backend = phi::MakeCpuBackend(1);
  for (int seed = 0; seed < num_seeds; ++seed) {
    options.seed = static_cast<std::uint32_t>(seed);
    Score score;
    for (std::size_t i = 0; i < jobs.size(); i += every) {
      const phi::SceneView& view = workspace.views()[jobs[i].image];
      phi::EstimationInput input;
      input.reference = {&view, workspace.ReadGray(jobs[i].image)};
      input.noise = phi::NoiseDeviation(input.reference.image->view());
      for (const int source : jobs[i].sources) input.sources.push_back({&workspace.views()[source], workspace.ReadGray(source)});
      const phi::SparseDepth sparse = sparse_depth.ForView(jobs[i].image);
      input.sparse = sparse.points;
      input.depth_min = sparse.range.min;
      input.depth_max = sparse.range.max;
      const double start = ProcessorSeconds();
      const phi::EstimationResult result = backend->Estimate(input, options);
      score.seconds += ProcessorSeconds() - start;
      score.counts += result.counts;
      score.pixels += static_cast<double>(result.map.size());
      std::filesystem::path path = truth_folder / (view.name + ".png");
      if (!std::filesystem::exists(path)) path = truth_folder / (std::filesystem::path(view.name).stem().string() + ".png");
      AddDepths(result.map, colmap_ext::ReadGray16Image(path), values_per_unit, &score);
    }
    std::printf("seed %d: %.0f samples/pixel %.1f hypotheses/pixel %.2f s/Mpixel; within 1 %%: %.2f, 0.3 %%: %.2f, 0.1 %%: %.2f\n",
                seed, score.counts.samples / score.pixels, score.counts.hypotheses / score.pixels,
                score.seconds / score.pixels * 1e6, 100 * score.within[0] / score.with_truth,
                100 * score.within[1] / score.with_truth, 100 * score.within[2] / score.with_truth);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc, argv);
  } catch (const phi::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
