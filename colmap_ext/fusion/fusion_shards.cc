#include "colmap_ext/fusion/fusion_shards.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/compact_map.h"
#include "colmap_ext/fusion/part_files.h"
#include "colmap_ext/fusion/scene_fuser.h"
#include "colmap_ext/pipeline/file_identity.h"
#include "colmap_ext/pipeline/result_key.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr char kSuffix[] = ".part";

// Size and time of the last change: the parts live for one job, in one folder.
void AddFile(const fs::path& path, ResultKey* key) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) status = {};
  key->Add(std::int64_t{status.st_size})
      .Add(std::int64_t{status.st_mtim.tv_sec})
      .Add(std::int64_t{status.st_mtim.tv_nsec});
}

// What the cloud follows from beside the images.
std::string OptionsText(const SceneFusionOptions& options) {
  std::string text = "part size=" + std::to_string(options.max_part_images) +
                     " downsize=" + std::to_string(options.input.downsize);
  SceneFusionOptions copy = options;
  for (const phi::Option& option : copy.List()) {
    if (!option.in_key()) continue;
    text += " " + option.name() + "=" + option.Text();
  }
  if (options.box) {
    for (int axis = 0; axis < 3; ++axis)
      text += " " + std::to_string(options.box->min[axis]) + ":" + std::to_string(options.box->max[axis]);
  }
  return text;
}

class PartedFusion {
 public:
  PartedFusion(const Workspace& workspace, const SceneFusionOptions& options, fs::path folder)
      : workspace_(workspace),
        options_(options),
        folder_(std::move(folder)),
        maps_(workspace, options.input),
        fuser_(workspace, maps_, options),
        earlier_(FindEarlierParts(fuser_.graph(), fuser_.parts())),
        options_text_(OptionsText(options)),
        image_keys_(fuser_.images().size()),
        keys_(fuser_.parts().size()) {
    // Side by side: a shared disk takes half a millisecond to answer.
    tbb::parallel_for(std::size_t{0}, image_keys_.size(), [this](std::size_t p) { image_keys_[p] = ImageKey(static_cast<int>(p)); });
  }

  int num_parts() const { return static_cast<int>(fuser_.parts().size()); }
  fs::path PathOf(int part) const { return folder_ / (std::to_string(part) + kSuffix); }
  bool IsMade(int part) { return IsPartFile(PathOf(part), KeyOf(part)) && HasConfidenceMaps(part); }

  // The first of the parts before it that is not made; -1: none.
  int FindMissing(int part) {
    for (const int earlier : earlier_[Index(part)]) {
      if (!IsMade(earlier)) return earlier;
    }
    return -1;
  }

  // Returns what it found.
  SceneFuser::Findings Make(int part) {
    for (const int earlier : earlier_[Index(part)]) {
      // Fused here, or read for a part before.
      if (fuser_.IsDone(fuser_.parts()[Index(earlier)].front())) continue;
      for (const PartImage& image : ReadPartImages(PathOf(earlier))) fuser_.SetDone(image.position, image.flags);
    }
    PartFileWriter writer(PathOf(part), KeyOf(part));
    const FusionPart& images = fuser_.parts()[Index(part)];
    fuser_.Fuse(images, &writer);
    fuser_.DropMaps();
    PartSummary summary{.findings = fuser_.TakeFindings(), .images = {}, .confidence_maps = {}};
    for (const int position : images) {
      summary.images.push_back({position, fuser_.FlagsOf(position)});
      if (options_.write_confidence_maps && !summary.findings.failures.contains(position))
        summary.confidence_maps[position] = IdentifyFile(ConfidenceMapPath(position));
    }
    SceneFuser::Findings findings = summary.findings;
    writer.SetSummary(std::move(summary));
    writer.Commit();
    return findings;
  }

  SceneFusionReport Join(CloudWriter* writer) {
    SceneFuser::Findings all;
    for (int part = 0; part < num_parts(); ++part) {
      if (!IsMade(part)) Make(part);
      CopyPartPoints(PathOf(part), writer);
      const SceneFuser::Findings findings = ReadPartFindings(PathOf(part));
      all.num_map_reads += findings.num_map_reads;
      all.num_points += findings.num_points;
      all.outcomes += findings.outcomes;
      all.failures.insert(findings.failures.begin(), findings.failures.end());
      all.noise.insert(findings.noise.begin(), findings.noise.end());
    }
    return fuser_.MakeReport(all);
  }

 private:
  static std::size_t Index(int i) { return static_cast<std::size_t>(i); }

  // All that the part follows from: options, cameras, files and neighbours of its images, and the parts before it.
  const std::string& KeyOf(int part) {
    std::string& known = keys_[Index(part)];
    if (!known.empty()) return known;
    ResultKey key;
    key.Add(options_text_);
    for (const int position : fuser_.parts()[Index(part)]) {
      key.Add(image_keys_[Index(position)]);
      for (const int neighbor : fuser_.graph()[Index(position)]) key.Add(image_keys_[Index(neighbor)]);
    }
    for (const int earlier : earlier_[Index(part)]) key.Add(KeyOf(earlier));
    known = key.Hex();
    return known;
  }

  fs::path ConfidenceMapPath(int position) const {
    return workspace_.ConfidenceMapPath(fuser_.images()[Index(position)], options_.input.kind);
  }

  // Of a whole part: whether those that were written with it, if any, are still there.
  bool HasConfidenceMaps(int part) const {
    if (!options_.write_confidence_maps) return true;
    const auto maps = ReadPartConfidenceMaps(PathOf(part));
    return std::all_of(maps.begin(), maps.end(),
                       [&](const auto& map) { return IsOneOf(ConfidenceMapPath(map.first), {map.second}); });
  }

  std::string ImageKey(int position) const {
    const int image = fuser_.images()[Index(position)];
    const phi::Camera& camera = fuser_.cameras()[Index(position)];
    ResultKey key;
    // Parts name their images by position, which moves where another image gains or loses its maps, and their points' views
    // by number in the model.
    key.Add(workspace_.views()[Index(image)].name).Add(std::int64_t{position}).Add(std::int64_t{image});
    for (const double value : {camera.pinhole.fx, camera.pinhole.fy, camera.pinhole.cx, camera.pinhole.cy})
      key.Add(value);
    for (const double value : camera.pose.rotation.reshaped()) key.Add(value);
    for (const double value : camera.pose.translation) key.Add(value);
    const std::string& kind = options_.input.kind;
    for (const fs::path& path :
         {workspace_.DepthMapPath(image, kind), workspace_.NormalMapPath(image, kind), CompactMapPath(workspace_, image, kind),
          workspace_.FilledMaskPath(image, kind), workspace_.ImagePath(image)}) {
      AddFile(path, &key);
    }
    if (!options_.input.mask_path.empty()) AddFile(workspace_.MaskPathIn(options_.input.mask_path, image), &key);
    return key.Hex();
  }

  const Workspace& workspace_;
  const SceneFusionOptions& options_;
  const fs::path folder_;
  const FusionMapReader maps_;
  SceneFuser fuser_;
  const std::vector<std::vector<int>> earlier_;
  const std::string options_text_;
  std::vector<std::string> image_keys_, keys_;  // by position, by part; an empty one of a part: not asked for yet
};

// Every shard's parts lie all over the scene, so that none waits for long.
ShardFusionReport MakeShardParts(PartedFusion* fusion, const Shard& shard) {
  ShardFusionReport report;
  int first_waiting = -1, missing = -1;
  for (int part = shard.index; part < fusion->num_parts(); part += shard.count) {
    ++report.num_parts;
    if (fusion->IsMade(part)) continue;
    const int earlier = fusion->FindMissing(part);
    if (earlier < 0) {
      const SceneFuser::Findings findings = fusion->Make(part);
      ++report.num_made;
      report.num_points += findings.num_points;
      report.num_failures += findings.failures.size();
      continue;
    }
    if (report.num_waiting++ > 0) continue;
    first_waiting = part;
    missing = earlier;
  }
  if (report.num_waiting > 0) {
    phi::LogWarning(
        "fusion: " + std::to_string(report.num_waiting) +
        " parts wait for others that other shards have not made yet: " + std::to_string(first_waiting) +
        " for " + std::to_string(missing) + "; run this shard again later");
  }
  return report;
}

}  // namespace

fs::path PartsFolder(const fs::path& cloud) { return fs::path(cloud) += ".parts"; }

ShardFusionReport FuseShard(const Workspace& workspace, const SceneFusionOptions& options,
                            const fs::path& parts_folder, const Shard& shard) {
  if (options.rule.method.formulas == phi::Formulas::kPaper) {
    throw phi::UsageError(
        "--shard is not for --PhiFusion.formulas paper, in which every image waits for all before it");
  }
  return OnFusionThreads(options, [&] {
    PartedFusion fusion(workspace, options, parts_folder);
    return MakeShardParts(&fusion, shard);
  });
}

SceneFusionReport JoinParts(const Workspace& workspace, const SceneFusionOptions& options,
                            const fs::path& parts_folder, CloudWriter* writer) {
  return OnFusionThreads(options, [&] { return PartedFusion(workspace, options, parts_folder).Join(writer); });
}

void RemoveParts(const fs::path& parts_folder) {
  std::vector<fs::path> paths;
  std::error_code ignored;  // what stays is taken for another cloud's, and made again
  for (fs::directory_iterator it(parts_folder, ignored), end; !ignored && it != end; it.increment(ignored)) {
    if (it->path().extension() == kSuffix || IsTemporaryFile(it->path())) paths.push_back(it->path());
  }
  for (const fs::path& path : paths) fs::remove(path, ignored);
  fs::remove(parts_folder, ignored);
}

}  // namespace colmap_ext
