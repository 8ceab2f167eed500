#include <string>

#include "colmap_ext/byte_count.h"
#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/memory_limit.h"
#include "phi/fusion/neighbor_lookup.h"

namespace colmap_ext {

phi::OptionList SceneFusionOptions::List() {
  constexpr const char* kSameCloud = "the cloud is the same";
  phi::OptionList list;
  list.AddChoice<std::string>("input_type", &input.kind,
                              {{"geometric", std::string(kGeometric)},
                               {"photometric", std::string(kPhotometric)},
                               {"measured", std::string(kMeasured)}},
                              "Kind of maps; measured: geometric without the inferred pixels");
  list.Add("StereoFusion.mask_path", &input.mask_path, "Folder of <image name>.png; 0 leaves a pixel out");
  list.AddChoice<FusionBackend>("PhiFusion.backend", &backend,
                                {{"auto", FusionBackend::kAuto}, {"cuda", FusionBackend::kCuda}, {"cpu", FusionBackend::kCpu}},
                                "Where to decide; auto = on a GPU where there is much to do. The cloud is the same")
      .NotInKey(kSameCloud);
  list.Add("StereoFusion.num_threads", &num_threads, "Threads; -1: all")
      .Between(-1, phi::kMaxThreads)
      .NotInKey(kSameCloud);
  list.Append(rule.List());
  list.Add("StereoFusion.check_num_images", &max_neighbors, "Images that each image is compared with; -1 = all")
      .ColmapDefault("50");
  list.Add("PhiFusion.write_confidence_maps", &write_confidence_maps,
           "Write how probably each pixel's depth is right to stereo/confidence_maps");
  list.Add("PhiFusion.max_memory_gb", &max_memory_gb, "Memory for maps; 0: half of what the process may use")
      .Unit("GB")
      .AtLeast(0)
      .NotInKey(kSameCloud);
  return list;
}

std::int64_t SceneFusionOptions::MemoryBytes() const {
  if (max_memory_gb > 0) return ByteCount(max_memory_gb * 1e9);
  return AvailableHostBytes() / 2;
}

std::string SceneFusionOptions::Check() const {
  if (const std::string problem = SceneFusionOptions(*this).List().Check(); !problem.empty()) return problem;
  if (const std::string problem = rule.Check(); !problem.empty()) return problem;
  if (write_confidence_maps && rule.method.formulas == phi::Formulas::kPaper)
    return "--PhiFusion.write_confidence_maps: with --PhiFusion.formulas paper nothing has a confidence; leave one of the two out";
  if (write_confidence_maps && input.downsize) {
    return "--PhiFusion.write_confidence_maps: they have the depth maps' size, which --StereoFusion.max_image_size would change; "
           "leave one of the two out";
  }
  constexpr int kMost = phi::kMaxFusionNeighbors / 2;
  if (max_neighbors == -1 || (max_neighbors >= 1 && max_neighbors <= kMost)) return "";
  return "--StereoFusion.check_num_images is " + std::to_string(max_neighbors) +
         ", but must be -1 (all) or between 1 and " + std::to_string(kMost);
}

}  // namespace colmap_ext
