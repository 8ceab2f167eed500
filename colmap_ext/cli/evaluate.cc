// phimvs evaluate: a cloud, depth maps or normal maps against the truth.
#include <tbb/global_control.h>

#include <algorithm>
#include <iostream>
#include <utility>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/byte_count.h"
#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/evaluation/score_tables.h"
#include "colmap_ext/evaluation/truth_cloud.h"
#include "colmap_ext/evaluation/truth_coverage.h"
#include "colmap_ext/processor_limit.h"
#include "colmap_ext/progress.h"
#include "colmap_ext/replaced_file.h"
#include "colmap_ext/text_stream.h"
#include "colmap_ext/workspace.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

struct EvaluateOptions {
  std::filesystem::path cloud, output;
  TruthOptions truth;
  CloudEvaluationOptions scoring;
  CoverageOptions coverage;
  bool coverage_by_visibility = false;
  std::filesystem::path transform, crop;
  CloudPreparation preparation;
  MapEvaluationOptions depth, normals;
  std::string tolerances = "0.01,0.02,0.05,0.1", angles = "5,10,20,30", scanners;
  double memory_gb = 8;
  bool inferred_apart = false;
  int num_threads = -1;
  TableFormat table = TableFormat::kText;
};

void AddCloudOptions(OptionParser& parser, EvaluateOptions& o) {
  parser.Add("cloud_path", &o.cloud, "Reconstructed cloud (.ply)");
  parser.Add("truth_path", &o.truth.path, "Truth: cloud or mesh (.ply), or laser scans with poses (.mlp)");
  parser.Add("tolerances", &o.tolerances, "Distances to score at, comma-separated, ascending")
      .Unit("world units");
  parser.Add("voxel_size", &o.scoring.voxel_size, "Voxels to average over").Unit("world units");
  parser.Add("min_truth_views", &o.truth.min_views,
             "Leave out true points whose PLY property 'views' is lower; 0 = keep all");
  parser
      .Add("mesh_sample_spacing", &o.truth.mesh_spacing,
           "Between samples of a mesh; 0 = a fifth of the least tolerance")
      .Unit("world units");
  parser.Add("scanner_position", &o.scanners,
             "Where the laser scanner of --truth_path stood, as x,y,z: unobserved space then does not count. "
             ".mlp projects say it themselves");
  parser.Add("beam_start_radius", &o.truth.beams.start_radius, "Radius of the scanner's beam at the scanner")
      .Unit("world units");
  parser
      .Add("beam_divergence_half_angle", &o.truth.beams.divergence_half_angle,
           "Widening of the scanner's beam")
      .Unit("degrees");
  parser.Add("coverage_workspace_path", &o.coverage.workspace,
             "Count only points that project onto a pixel with truth (--truth_depth_maps) in an image of "
             "this workspace");
  parser.Add("coverage_by_visibility", &o.coverage_by_visibility,
             "Where the truth hides a point, that pixel counts in images alone that see the point "
             "(CLOUD.vis): surfaces that were "
             "not scanned may lie behind ones that were");
  parser.Add("cloud_transform_path", &o.transform,
             "File with the 4 x 4 matrix that takes the cloud to the truth's frame");
  parser.Add("crop_volume_path", &o.crop,
             "Score the points of both clouds within this volume alone: a .json as Tanks and Temples has");
  parser.Add(
      "thin_clouds", &o.preparation.thin,
      "First make one point of all points of a voxel, as Tanks and Temples does with voxels of half the "
      "tolerance");
  parser.Add("memory", &o.memory_gb, "Memory for clouds and search").Unit("GB");
}

void AddMapOptions(OptionParser& parser, EvaluateOptions& o) {
  parser.Add("depth_maps", &o.depth.maps, "Folder of depth maps to score, as stereo/depth_maps");
  parser.Add("truth_depth_maps", &o.depth.truth,
             "Folder of true depths: COLMAP's .bin or 16-bit .png, by image name");
  parser.Add("truth_depth_scale", &o.depth.values_per_unit, "Value of one world unit in 16-bit .png depths");
  parser.Add("normal_maps", &o.normals.maps, "Folder of normal maps to score, as stereo/normal_maps");
  parser.Add("truth_normal_maps", &o.normals.truth, "Folder of true normals: COLMAP's .bin, by image name");
  parser.Add("normal_tolerances", &o.angles, "Angles to score normals at, comma-separated, ascending")
      .Unit("degrees");
  parser.Add("map_type", &o.depth.kind, "Which maps: geometric, measured or photometric");
}

std::vector<double> ParseNumbers(const std::string& text, const std::string& option) {
  std::vector<double> numbers;
  TextInput stream(text);
  for (std::string word; std::getline(stream, word, ',');) {
    TextInput number(word);
    double value = 0;
    if (!(number >> value) || !(number >> std::ws).eof()) {
      throw phi::UsageError("--" + option + " must be numbers separated by commas, not '" + text + "'");
    }
    numbers.push_back(value);
  }
  return numbers;
}

void Require(bool condition, const std::string& message) {
  if (!condition) throw phi::UsageError(phi::AboutStage("evaluate") + ": " + message);
}

// Puts the parts together and checks what belongs together.
void Complete(EvaluateOptions& o) {
  o.scoring.tolerances = o.depth.thresholds = ParseNumbers(o.tolerances, "tolerances");
  o.normals.thresholds = ParseNumbers(o.angles, "normal_tolerances");
  Require(o.memory_gb > 0, "--memory must be positive");
  o.scoring.memory = static_cast<std::size_t>(ByteCount(o.memory_gb * 1e9));
  o.truth.memory = o.scoring.memory;
  Require(o.truth.min_views >= 0, "--min_truth_views must not be negative");
  const std::string error = o.scoring.Check();
  Require(error.empty(), error);
  Require(o.truth.beams.start_radius >= 0, "--beam_start_radius must not be negative");
  constexpr double kWidestBeam = 90;
  Require(o.truth.beams.divergence_half_angle >= 0 && o.truth.beams.divergence_half_angle < kWidestBeam,
          "--beam_divergence_half_angle must be 0 or more, and less than 90");
  Require(o.truth.mesh_spacing >= 0, "--mesh_sample_spacing must not be negative");
  Require(o.depth.values_per_unit > 0, "--truth_depth_scale must be positive");
  if (o.truth.mesh_spacing == 0) o.truth.mesh_spacing = o.scoring.tolerances.front() / 5;
  if (!o.scanners.empty()) {
    const std::vector<double> xyz = ParseNumbers(o.scanners, "scanner_position");
    Require(xyz.size() == 3, "--scanner_position takes x,y,z");
    o.truth.scanners.emplace_back(xyz[0], xyz[1], xyz[2]);
  }
  o.normals.kind = o.depth.kind;
  o.depth.inferred_apart = o.normals.inferred_apart = o.inferred_apart;
  o.coverage.truth_depth_maps = o.depth.truth;
  o.coverage.values_per_unit = o.depth.values_per_unit;

  Require(!o.cloud.empty() || !o.depth.maps.empty() || !o.normals.maps.empty(),
          "give --cloud_path with --truth_path, --depth_maps with --truth_depth_maps, or --normal_maps with "
          "--truth_normal_maps");
  Require(o.cloud.empty() == o.truth.path.empty(), "--cloud_path and --truth_path go together");
  Require(o.depth.maps.empty() || !o.depth.truth.empty(), "--depth_maps needs --truth_depth_maps");
  Require(o.normals.maps.empty() == o.normals.truth.empty(),
          "--normal_maps and --truth_normal_maps go together");
  const bool scores_maps = !o.depth.maps.empty() || !o.normals.maps.empty();
  Require(!o.inferred_apart || !scores_maps || o.depth.kind == kGeometric,
          "--inferred_apart is for --map_type geometric: the other maps hold no inferred pixel");
  const bool is_prepared = !o.transform.empty() || !o.crop.empty() || o.preparation.thin;
  Require(
      !is_prepared || (o.coverage.workspace.empty() && o.truth.scanners.empty() && !o.inferred_apart &&
                       o.truth.path.extension() != ".mlp"),
      "--cloud_transform_path, --crop_volume_path and --thin_clouds are for clouds alone, without scanners, "
      "coverage or inferred points apart");
  if (!o.transform.empty()) o.preparation.truth_from_cloud = ReadSimilarity(o.transform);
  if (!o.crop.empty()) o.preparation.crop = ReadCropVolume(o.crop);
  Require(o.coverage.workspace.empty() || !o.depth.truth.empty(),
          "--coverage_workspace_path needs --truth_depth_maps");
  Require(!o.coverage_by_visibility || !o.coverage.workspace.empty(),
          "--coverage_by_visibility needs --coverage_workspace_path");
  if (o.coverage_by_visibility) o.coverage.visibility = o.cloud.string() + ".vis";
  o.coverage.hidden_by = o.scoring.tolerances.back();
}

CloudScores EvaluateClouds(const EvaluateOptions& o) {
  constexpr double kReading = 1, kComparing = 2;  // expected times, in one unit
  ProgressLine progress(
      std::vector<ProgressStage>{{.name = "reading clouds", .weight = kReading, .unit = "steps"},
                                 {.name = "comparing clouds", .weight = kComparing, .unit = "steps"}});
  progress.SetNumTasks(0, 1);
  progress.SetNumTasks(1, 1);
  LoadedClouds loaded;
  {
    const ProgressLine::Task task(&progress);
    loaded = LoadClouds(o.cloud, o.truth, o.scoring.voxel_size, o.inferred_apart, o.preparation);
    if (!o.coverage.workspace.empty()) {
      loaded.clouds.counted = CoveredByTruth(loaded.clouds.points, loaded.origin, o.coverage);
    }
  }
  const ProgressLine::Task task(&progress, 1);
  return EvaluateCloud(std::move(loaded.clouds), o.scoring);
}

}  // namespace

int RunEvaluate(int argc, char** argv) {
  EvaluateOptions o;
  o.truth.mesh_spacing = 0;
  OptionParser parser("evaluate", "Compare a cloud, depth maps or normal maps with the truth");
  AddCloudOptions(parser, o);
  AddMapOptions(parser, o);
  parser.Add("inferred_apart", &o.inferred_apart,
             "Also score measured and inferred points apart (the cloud's property 'inferred'), and pixels "
             "(the folder filled_masks beside the maps')");
  parser.Add("output_path", &o.output, "Scores as JSON");
  parser.AddChoice("table", &o.table, {{"text", TableFormat::kText}, {"markdown", TableFormat::kMarkdown}},
                   "Form of the printed tables");
  parser.Add("num_threads", &o.num_threads, "Threads; -1 = all").Between(-1, phi::kMaxThreads);
  if (!parser.Parse(argc, argv)) return 0;
  Complete(o);
  if (!o.output.empty()) {
    RequireReplaceable(o.output, "{", "table of scores");
    AtomicFile(o.output, Durability::kProcess);  // tries it before long work
  }

  const auto threads = static_cast<std::size_t>(o.num_threads > 0 ? o.num_threads : NumProcessors());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  Evaluation evaluation;
  if (!o.cloud.empty()) evaluation.cloud = EvaluateClouds(o);
  if (!o.depth.maps.empty()) evaluation.depth = EvaluateDepthMaps(o.depth);
  if (!o.normals.maps.empty()) evaluation.normals = EvaluateNormalMaps(o.normals);
  std::cout << FormatTables(evaluation, o.table);
  if (!o.output.empty()) WriteScoresJson(o.output, evaluation);
  return 0;
}

}  // namespace colmap_ext
