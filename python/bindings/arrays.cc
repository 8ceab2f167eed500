// The stages on arrays: nothing is read or written. phimvs/scene.py checks what comes in and says what goes out.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/cli/fusion_options.h"
#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/cli/stereo_options.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/image_moves.h"
#include "colmap_ext/pipeline/memory_scene.h"
#include "phi/base/array_memory.h"
#include "phi/base/error.h"
#include "python/bindings/module.h"
#include "python/bindings/numpy_arrays.h"
#include "python/bindings/scene_arrays.h"
#include "python/bindings/supervised.h"
#include "python/bindings/text_caster.h"

namespace nb = nanobind;
using colmap_ext::SceneMaps;

namespace phimvs_python {
namespace {

using Floats = Input<float>;

// Options that name files, and what takes their place.
using FileOptions = std::vector<std::pair<std::string, std::string>>;

// The command line's options, with its grammar and checks.
template <typename Options, typename Register>
Options ParseOptions(const char* command, std::vector<std::string> words, const FileOptions& refused,
                     Register register_options) {
  Options options;
  colmap_ext::OptionParser parser(command, "");
  register_options(&options, &parser);
  words.insert(words.begin(), command);
  std::vector<const char*> argv;
  for (const std::string& word : words) argv.push_back(word.c_str());
  parser.Parse(static_cast<int>(argv.size()), argv.data());
  for (const auto& [name, instead] : refused) {
    if (parser.IsSet(name))
      throw phi::UsageError("--" + name + " names files, and has no effect on arrays; " + instead);
  }
  options.Finish(parser);
  return options;
}

colmap_ext::StereoCommandOptions ParseStereo(std::vector<std::string> words, bool filling) {
  words.insert(words.end(), {"--workspace_path", "/dev/null/memory"});
  return ParseOptions<colmap_ext::StereoCommandOptions>(
      filling ? "infer_planes" : "estimate", std::move(words),
      {{"PhiStereo.mask_path", "give masks"}, {"config_path", "give sources"}},
      [filling](auto* options, auto* parser) {
        filling ? options->RegisterFilling(parser) : options->Register(parser);
      });
}

// Depth, normal, inferred, confidence; camera at the map's size; problem.
struct MapArrays {
  std::vector<float> depth, normal, confidence;
  std::vector<std::uint8_t> inferred;
  phi::Pinhole pinhole;
  std::string problem;
};

MapArrays ArraysOf(const SceneMaps& maps, const phi::Pinhole& pinhole) {
  const std::size_t size = maps.map->size();
  MapArrays arrays{std::vector<float>(size), std::vector<float>(3 * size), std::vector<float>(size),
                   std::vector<std::uint8_t>(size), pinhole, maps.problem};
  for (std::size_t i = 0; i < size; ++i) {
    const phi::PlaneHypothesis& h = maps.map->data()[i];
    if (!(h.depth > 0)) continue;
    arrays.depth[i] = h.depth;
    arrays.normal[3 * i] = h.normal.x;
    arrays.normal[3 * i + 1] = h.normal.y;
    arrays.normal[3 * i + 2] = h.normal.z;
    arrays.inferred[i] = maps.inferred != nullptr && maps.inferred->data()[i] != 0;
    const bool has_cost = maps.cost != nullptr && arrays.inferred[i] == 0;
    if (has_cost) arrays.confidence[i] = std::clamp(1 - maps.cost->data()[i] / 2, 0.0f, 1.0f);
  }
  return arrays;
}

std::vector<MapArrays> ArraysOf(const std::vector<SceneMaps>& maps, const colmap_ext::Workspace& workspace) {
  std::vector<MapArrays> arrays(maps.size());
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t i) {
    arrays[i] = ArraysOf(maps[i], workspace.views()[i].camera.pinhole);
  });
  return arrays;
}

nb::list ToPython(std::vector<MapArrays> maps) {
  nb::list list;
  for (MapArrays& m : maps) {
    const auto height = static_cast<std::size_t>(m.pinhole.height), width = static_cast<std::size_t>(m.pinhole.width);
    const phi::Pinhole& k = m.pinhole;
    list.append(nb::make_tuple(MakeOutput(std::move(m.depth), {height, width}),
                               MakeOutput(std::move(m.normal), {height, width, 3}),
                               MakeOutput(std::move(m.inferred), {height, width}),
                               MakeOutput(std::move(m.confidence), {height, width}),
                               nb::make_tuple(k.fx, k.fy, k.cx, k.cy), TextOf(m.problem)));
  }
  return list;
}

using Sources = std::vector<std::vector<int>>;

nb::list Estimate(const Scene& scene, const Sources& sources, const std::vector<std::string>& words,
                  const Listeners& listeners) {
  std::vector<MapArrays> arrays;
  RunSupervised(listeners, [&] {
    colmap_ext::StereoCommandOptions options = ParseStereo(words, false);
    options.pipeline.write_cost_maps = true;  // for the confidence
    colmap_ext::Workspace workspace = WorkspaceOf(scene, options.workspace.max_image_size);
    colmap_ext::MoveImages(colmap_ext::MakeSparseScene(workspace.model()), options.pipeline.stereo, &workspace);
    const auto backends = colmap_ext::MakeBackends(options.backend, workspace.LargestImage());
    arrays = ArraysOf(colmap_ext::EstimateScene(workspace, sources, options.pipeline, backends), workspace);
  });
  return ToPython(std::move(arrays));
}

struct GivenMap {
  Floats depth, normal;  // H x W, H x W x 3
  std::optional<Bytes> inferred;
};

std::shared_ptr<const phi::PlaneMap> PlaneMapOf(const GivenMap& given) {
  auto map = std::make_shared<phi::PlaneMap>(static_cast<int>(given.depth.shape(1)), static_cast<int>(given.depth.shape(0)));
  for (std::size_t i = 0; i < map->size(); ++i) {
    const float depth = given.depth.data()[i];
    const float* n = given.normal.data() + 3 * i;
    if (depth > 0) map->data()[i] = {{n[0], n[1], n[2]}, depth};
  }
  return map;
}

std::vector<SceneMaps> MapsOf(const std::vector<GivenMap>& given) {
  std::vector<SceneMaps> maps(given.size());
  tbb::parallel_for(std::size_t{0}, given.size(), [&](std::size_t i) {
    maps[i].map = PlaneMapOf(given[i]);
    if (!given[i].inferred) return;
    auto inferred = std::make_shared<phi::Mask>(maps[i].map->width(), maps[i].map->height());
    std::memcpy(inferred->data(), given[i].inferred->data(), inferred->bytes());
    maps[i].inferred = std::move(inferred);
  });
  return maps;
}

nb::list InferPlanes(const Scene& scene, const std::vector<GivenMap>& given, const Sources& sources,
                     const std::vector<std::string>& words, const Listeners& listeners) {
  std::vector<MapArrays> arrays;
  RunSupervised(listeners, [&] {
    const colmap_ext::StereoCommandOptions options = ParseStereo(words, true);
    const auto workspace = WorkspaceOf(scene, -1);
    const auto backends = colmap_ext::MakeBackends(options.backend, workspace.LargestImage());
    std::vector<std::shared_ptr<const phi::PlaneMap>> measured;
    for (const SceneMaps& maps : MapsOf(given)) measured.push_back(maps.map);
    arrays = ArraysOf(colmap_ext::FillScene(workspace, sources, measured, options.pipeline, backends), workspace);
  });
  return ToPython(std::move(arrays));
}

// First touched by the threads that fill it.
template <typename T>
using LargeVector = std::vector<T, phi::ArrayAllocator<T>>;

struct CloudArrays {
  LargeVector<double> xyz;
  LargeVector<float> normals;
  LargeVector<std::uint8_t> colors, inferred, confidence;
  LargeVector<std::uint32_t> view_counts, views;

  CloudArrays(std::size_t num_points, std::size_t num_views)
      : xyz(3 * num_points),
        normals(3 * num_points),
        colors(3 * num_points),
        inferred(num_points),
        confidence(num_points),
        view_counts(num_points),
        views(num_views) {}

  void Set(const phi::FusedBlock& block, std::size_t first_point, std::size_t first_view) {
    for (std::size_t i = 0; i < block.points.size(); ++i) {
      const phi::FusedPoint& point = block.points[i];
      const std::size_t place = first_point + i;
      std::copy_n(point.xyz, 3, xyz.data() + 3 * place);
      std::copy_n(point.normal, 3, normals.data() + 3 * place);
      std::copy_n(point.rgb, 3, colors.data() + 3 * place);
      inferred[place] = point.inferred;
      confidence[place] = point.confidence;
    }
    std::copy(block.view_counts.begin(), block.view_counts.end(), view_counts.data() + first_point);
    std::copy(block.views.begin(), block.views.end(), views.data() + first_view);
  }
};

// A block is freed when its points are in the arrays: a large cloud is not held twice.
CloudArrays ArraysOf(std::vector<phi::FusedBlock> blocks) {
  std::vector<std::size_t> first_point{0}, first_view{0};
  for (const phi::FusedBlock& block : blocks) {
    first_point.push_back(first_point.back() + block.points.size());
    first_view.push_back(first_view.back() + block.views.size());
  }
  CloudArrays arrays(first_point.back(), first_view.back());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const phi::FusedBlock block = std::move(blocks[b]);
    arrays.Set(block, first_point[b], first_view[b]);
  });
  return arrays;
}

// xyz, normals, colors, inferred, confidence, view_counts, views.
nb::tuple Fuse(const Scene& scene, const std::vector<GivenMap>& given, const std::vector<std::string>& words,
               const Listeners& listeners) {
  CloudArrays arrays(0, 0);
  RunSupervised(listeners, [&] {
    auto options = ParseOptions<colmap_ext::FusionCommandOptions>(
        "fuse", words, {}, [](auto* fusion, auto* parser) { fusion->RegisterFusion(parser); });
    if (options.fusion.input.kind != colmap_ext::kGeometric) {
      throw phi::UsageError("--input_type " + options.fusion.input.kind +
                            " chooses files, and has no effect on arrays; give "
                            "maps with depth where it is wanted, such as m.depth * m.measured");
    }
    arrays = ArraysOf(colmap_ext::FuseSceneMaps(WorkspaceOf(scene, -1), MapsOf(given), options.fusion).blocks);
  });
  const std::size_t n = arrays.view_counts.size(), num_views = arrays.views.size();
  return nb::make_tuple(MakeOutput(std::move(arrays.xyz), {n, 3}), MakeOutput(std::move(arrays.normals), {n, 3}),
                        MakeOutput(std::move(arrays.colors), {n, 3}), MakeOutput(std::move(arrays.inferred), {n}),
                        MakeOutput(std::move(arrays.confidence), {n}),
                        MakeOutput(std::move(arrays.view_counts), {n}), MakeOutput(std::move(arrays.views), {num_views}));
}

}  // namespace

void BindArrays(nb::module_& module) {
  nb::class_<GivenMap>(module, "GivenMap")
      .def("__init__", [](GivenMap* map, Floats depth, Floats normal, std::optional<Bytes> inferred) {
        new (map) GivenMap{depth, normal, std::move(inferred)};
      }, nb::arg("depth"), nb::arg("normal"), nb::arg("inferred").none());
  nb::class_<Listeners>(module, "Listeners")
      .def("__init__", [](Listeners* listeners, nb::callable log, nb::object progress, bool debug) {
        new (listeners) Listeners{std::move(log), std::move(progress), debug};
      }, nb::arg("log"), nb::arg("progress").none(), nb::arg("debug"));
  module.def("estimate", &Estimate);
  module.def("infer_planes", &InferPlanes);
  module.def("fuse", &Fuse);
}

}  // namespace phimvs_python
