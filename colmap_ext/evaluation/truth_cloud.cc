#include "colmap_ext/evaluation/truth_cloud.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "colmap_ext/evaluation/meshlab_project.h"
#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/evaluation/thin_cloud.h"
#include "colmap_ext/format_text.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

using Eigen::Vector3d;
using phi::Vec3f;

// Beyond this many world units a float's step nears a millimetre's tenth, so the clouds are moved to their
// first point.
constexpr double kFarFromOrigin = 1000;

// Farther out, squares of distances and sums over points leave single precision, and the search for neighbours would end in a
// crash. No scene reaches so far: such a point is as wrong there as where it is.
constexpr double kFarthest = 1e15;

Vec3f Relative(const Vector3d& world, const Vector3d& origin) {
  const Vector3d r = (world - origin).cwiseMax(-kFarthest).cwiseMin(kFarthest);
  return {static_cast<float>(r.x()), static_cast<float>(r.y()), static_cast<float>(r.z())};
}

Vector3d ChooseOrigin(const Vector3d& point, double voxel_size) {
  if (point.cwiseAbs().maxCoeff() < kFarFromOrigin) return Vector3d::Zero();
  return (point / voxel_size).array().round().matrix() * voxel_size;
}

void CheckVertices(const PlyRows& rows, const std::filesystem::path& path) {
  const PlyElement* vertex = rows.Find("vertex");
  const auto has_number = [&](const char* name) {
    return std::any_of(vertex->properties.begin(), vertex->properties.end(),
                       [&](const PlyProperty& p) { return p.name == name && p.count_type < 0; });
  };
  if (!vertex || !has_number("x") || !has_number("y") || !has_number("z")) {
    throw phi::InputError(phi::AboutFile(path) + " has no vertices with x, y and z");
  }
}

bool HasViews(const std::filesystem::path& path) { return PlyRows(path).Find("vertex")->Has("views"); }

// Of the file's positions from the world's, as its header says.
Vector3d OffsetOf(const PlyRows& rows, const std::filesystem::path& path) {
  const Vector3d offset(rows.offset().data());
  if (!offset.isZero(0)) {
    phi::LogInfo(path.string() + FormatText(": the offset %.17g %.17g %.17g of its header is added", offset.x(), offset.y(), offset.z()));
  }
  return offset;
}

// on_point(position, property `views`, NaN where there is none); `needs_views`: refuses files without it.
template <typename OnPoint>
void ForEachPoint(const std::filesystem::path& path, bool needs_views, OnPoint on_point) {
  const PlyRows rows(path);
  CheckVertices(rows, path);
  if (needs_views && !rows.Find("vertex")->Has("views")) {
    throw phi::InputError(phi::AboutFile(path) + " has no property 'views', which --min_truth_views needs");
  }
  const Vector3d offset = OffsetOf(rows, path);
  rows.ForEachRow("vertex", {"x", "y", "z", "views"}, [&](const double* v) {
    const Vector3d p = Vector3d(v[0], v[1], v[2]) + offset;
    if (p.allFinite()) on_point(p, v[3]);
  });
}

// The property `inferred` of the points that ForEachPoint visits.
std::vector<bool> ReadInferred(const std::filesystem::path& path) {
  const PlyRows rows(path);
  CheckVertices(rows, path);
  if (!rows.Find("vertex")->Has("inferred")) {
    throw phi::InputError(phi::AboutFile(path) +
                          " has no property 'inferred', which --inferred_apart needs: clouds by "
                          "phimvs stereo_fusion in PLY have it");
  }
  std::vector<bool> inferred;
  rows.ForEachRow("vertex", {"x", "y", "z", "inferred"}, [&](const double* v) {
    if (Vector3d(v[0], v[1], v[2]).allFinite()) inferred.push_back(v[3] != 0);
  });
  return inferred;
}

// Triangles of finite corners.
template <typename OnTriangle>
void ForEachTriangle(const std::filesystem::path& path, OnTriangle on_triangle) {
  const PlyRows rows(path);
  const Vector3d offset = OffsetOf(rows, path);
  std::vector<Vector3d> corners;
  rows.ForEachRow("vertex", {"x", "y", "z"},
                  [&](const double* v) { corners.push_back(Vector3d(v[0], v[1], v[2]) + offset); });
  const char* list = rows.Find("face")->Has("vertex_indices") ? "vertex_indices" : "vertex_index";
  rows.ForEachList("face", list, [&](const std::vector<std::int64_t>& face) {
    phi::ThrowIfCancelled();
    for (std::int64_t index : face) {
      if (index < 0 || index >= static_cast<std::int64_t>(corners.size())) {
        throw phi::InputError(phi::AboutFile(path) + ": a face names vertex " + std::to_string(index) + " of " +
                              std::to_string(corners.size()));
      }
    }
    for (std::size_t i = 2; i < face.size(); ++i) {
      const Vector3d &a = corners[face[0]], &b = corners[face[i - 1]], &c = corners[face[i]];
      if (a.allFinite() && b.allFinite() && c.allFinite()) on_triangle(a, b, c);
    }
  });
}

bool IsMesh(const std::filesystem::path& path) {
  const PlyRows rows(path);
  CheckVertices(rows, path);
  const PlyElement* face = rows.Find("face");
  return face && face->count > 0;
}

class Loader {
 public:
  Loader(const TruthOptions& truth, double voxel_size, const CloudPreparation& preparation)
      : truth_(truth), voxel_size_(voxel_size), preparation_(preparation) {}

  LoadedClouds Load(const std::filesystem::path& cloud_path) {
    if (truth_.path.extension() == ".mlp") {
      LoadScans();
    } else if (IsMesh(truth_.path)) {
      LoadMesh();
    } else {
      const bool has_views = HasViews(truth_.path);
      std::vector<Vector3d> left_out;
      ForEachPoint(truth_.path, truth_.min_views > 0, [&](const Vector3d& p, double views) {
        if (IsLeftOut(views)) {
          if (IsInside(p)) left_out.push_back(p);
          return;
        }
        if (AddTruth(p) && has_views) AddViews(views);
      });
      for (const Vector3d& p : left_out) {
        result_.clouds.truth_left_out.push_back(Relative(p, result_.origin));
      }
    }
    if (result_.clouds.truth.empty())
      throw phi::InputError(phi::AboutFile(truth_.path) + " holds no point to compare with" +
                            (preparation_.crop ? " in the volume of --crop_volume_path" : ""));
    for (const Vector3d& scanner : truth_.scanners) AddScan(result_.clouds.truth, scanner);
    const Eigen::Affine3d truth_from_cloud(
        preparation_.truth_from_cloud.value_or(Eigen::Matrix4d::Identity()));
    ForEachPoint(cloud_path, false, [&](const Vector3d& given, double) {
      const Vector3d p = truth_from_cloud * given;
      if (!IsInside(p)) return;
      result_.clouds.points.push_back(Relative(p, result_.origin));
      RequireMemory(0, "the clouds");
    });
    if (preparation_.thin) {
      Thin(&result_.clouds.points);
      Thin(&result_.clouds.truth);
      result_.clouds.truth_views.clear();  // a voxel's points were seen by different images
    }
    return std::move(result_);
  }

 private:
  bool IsInside(const Vector3d& p) const { return !preparation_.crop || preparation_.crop->Contains(p); }

  bool AddTruth(const Vector3d& p) {
    if (!IsInside(p)) return false;
    if (result_.clouds.truth.empty()) result_.origin = ChooseOrigin(p, voxel_size_);
    result_.clouds.truth.push_back(Relative(p, result_.origin));
    RequireMemory(0, "the clouds");
    return true;
  }

  // For `more` points beyond those that are there.
  void RequireMemory(double more, const char* what) const {
    const auto num_points = static_cast<double>(result_.clouds.truth.size() + result_.clouds.points.size());
    if ((num_points + more) * sizeof(Vec3f) <= static_cast<double>(truth_.memory)) return;
    throw phi::ResourceError(phi::AboutFile(truth_.path) + ": " + what +
                             " need more than --memory allows; raise it, thin the clouds, or raise "
                             "--mesh_sample_spacing where the truth is a mesh");
  }

  void Thin(std::vector<Vec3f>* cloud) const {
    RequireMemory(static_cast<double>(cloud->size()) / 8 / sizeof(Vec3f), "the clouds and what thins them");
    const CloudPair& all = result_.clouds;
    const std::size_t used = (all.truth.size() + all.points.size() + all.truth_left_out.size()) * sizeof(Vec3f) + cloud->size() / 8;
    *cloud = ThinCloud(std::move(*cloud), voxel_size_, truth_.memory - std::min(used, truth_.memory));
  }

  // A triangle's samples are counted before they are made: a single one may be larger than any memory.
  void LoadMesh() {
    ForEachTriangle(truth_.path, [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
      RequireMemory(NumTriangleSamples(a, b, c, truth_.mesh_spacing), "the mesh's samples");
      SampleTriangle(a, b, c, truth_.mesh_spacing, [&](const Vector3d& p) { AddTruth(p); });
    });
  }

  bool IsLeftOut(double views) const { return views < truth_.min_views; }

  void AddViews(double views) {
    result_.clouds.truth_views.push_back(static_cast<std::uint8_t>(std::clamp(views, 0.0, 255.0)));
  }

  void AddScan(const std::vector<Vec3f>& points, const Vector3d& scanner) {
    result_.clouds.scans.emplace_back(points, Relative(scanner, result_.origin), truth_.beams);
  }

  // A scan's own frame has the scanner at its origin.
  void LoadScans() {
    for (const MeshLabLayer& layer : ReadMeshLabProject(truth_.path)) {
      const Eigen::Affine3d world_from_scan(layer.world_from_layer);
      const std::size_t begin = result_.clouds.truth.size();
      ForEachPoint(layer.path, truth_.min_views > 0, [&](const Vector3d& p, double views) {
        if (!IsLeftOut(views)) AddTruth(world_from_scan * p);
      });
      if (begin == result_.clouds.truth.size()) continue;
      AddScan({result_.clouds.truth.begin() + begin, result_.clouds.truth.end()},
              world_from_scan.translation());
    }
  }

  const TruthOptions& truth_;
  double voxel_size_;
  const CloudPreparation& preparation_;
  LoadedClouds result_;
};

}  // namespace

double NumTriangleSamples(const Vector3d& a, const Vector3d& b, const Vector3d& c, double spacing) {
  const double rows = std::max(1.0, std::max((b - a).norm(), (c - a).norm()) / spacing);
  return rows * std::max(1.0, (c - b).norm() / spacing / 2);
}

void SampleTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, double spacing,
                    const std::function<void(const Vector3d&)>& on_sample) {
  // Rows parallel to bc, from a; row r of n has its own number of samples, so that both spacings hold.
  const double reach = std::max((b - a).norm(), (c - a).norm());
  const auto rows = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(reach / spacing)));
  on_sample(a);
  for (std::int64_t r = 1; r <= rows; ++r) {
    phi::ThrowIfCancelled();
    const double t = static_cast<double>(r) / static_cast<double>(rows);
    const Vector3d from = a + t * (b - a), to = a + t * (c - a);
    const auto steps =
        std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil((to - from).norm() / spacing)));
    for (std::int64_t s = 0; s <= steps; ++s) {
      on_sample(from + (to - from) * (static_cast<double>(s) / static_cast<double>(steps)));
    }
  }
}

LoadedClouds LoadClouds(const std::filesystem::path& cloud_path, const TruthOptions& truth, double voxel_size,
                        bool inferred_apart, const CloudPreparation& preparation) {
  LoadedClouds loaded = Loader(truth, voxel_size, preparation).Load(cloud_path);
  if (inferred_apart) loaded.clouds.inferred = ReadInferred(cloud_path);
  return loaded;
}

}  // namespace colmap_ext
