#include "colmap_ext/evaluation/truth_cloud.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "colmap_ext/evaluation/meshlab_project.h"
#include "colmap_ext/evaluation/ply_rows.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using Eigen::Vector3d;
using phi::Vec3f;

// Beyond this many world units a float's step nears a millimetre's tenth, so the clouds are moved to their
// first point.
constexpr double kFarFromOrigin = 1000;

Vec3f Relative(const Vector3d& world, const Vector3d& origin) {
  const Vector3d r = world - origin;
  return {static_cast<float>(r.x()), static_cast<float>(r.y()), static_cast<float>(r.z())};
}

Vector3d ChooseOrigin(const Vector3d& point, double voxel_size) {
  if (point.cwiseAbs().maxCoeff() < kFarFromOrigin) return Vector3d::Zero();
  return (point / voxel_size).array().round().matrix() * voxel_size;
}

void CheckVertices(const PlyRows& rows, const std::filesystem::path& path) {
  const PlyElement* vertex = rows.Find("vertex");
  if (!vertex || !vertex->Has("x") || !vertex->Has("y") || !vertex->Has("z")) {
    throw phi::InputError(path.string() + " has no vertices with x, y and z");
  }
}

bool HasViews(const std::filesystem::path& path) { return PlyRows(path).Find("vertex")->Has("views"); }

// on_point(position, property `views`, NaN where there is none).
template <typename OnPoint>
void ForEachPoint(const std::filesystem::path& path, int min_views, OnPoint on_point) {
  const PlyRows rows(path);
  CheckVertices(rows, path);
  if (min_views > 0 && !rows.Find("vertex")->Has("views")) {
    throw phi::InputError(path.string() + " has no property 'views', which --min_truth_views needs");
  }
  rows.ForEachRow("vertex", {"x", "y", "z", "views"}, [&](const double* v) {
    if (min_views > 0 && v[3] < min_views) return;
    const Vector3d p(v[0], v[1], v[2]);
    if (p.allFinite()) on_point(p, v[3]);
  });
}

// The property `inferred` of the points that ForEachPoint visits.
std::vector<bool> ReadInferred(const std::filesystem::path& path) {
  const PlyRows rows(path);
  CheckVertices(rows, path);
  if (!rows.Find("vertex")->Has("inferred")) {
    throw phi::InputError(path.string() +
                          " has no property 'inferred', which --inferred_apart needs: clouds by "
                          "phimvs stereo_fusion in PLY have it");
  }
  std::vector<bool> inferred;
  rows.ForEachRow("vertex", {"x", "y", "z", "inferred"}, [&](const double* v) {
    if (Vector3d(v[0], v[1], v[2]).allFinite()) inferred.push_back(v[3] != 0);
  });
  return inferred;
}

std::vector<Vector3d> SampleMesh(const std::filesystem::path& path, double spacing) {
  const PlyRows rows(path);
  std::vector<Vector3d> corners, samples;
  rows.ForEachRow("vertex", {"x", "y", "z"},
                  [&](const double* v) { corners.emplace_back(v[0], v[1], v[2]); });
  const char* list = rows.Find("face")->Has("vertex_indices") ? "vertex_indices" : "vertex_index";
  rows.ForEachList("face", list, [&](const std::vector<std::int64_t>& face) {
    for (std::int64_t index : face) {
      if (index < 0 || index >= static_cast<std::int64_t>(corners.size())) {
        throw phi::InputError(path.string() + ": a face names vertex " + std::to_string(index) + " of " +
                              std::to_string(corners.size()));
      }
    }
    for (std::size_t i = 2; i < face.size(); ++i) {
      SampleTriangle(corners[face[0]], corners[face[i - 1]], corners[face[i]], spacing, samples);
    }
  });
  return samples;
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
      for (const Vector3d& p : SampleMesh(truth_.path, truth_.mesh_spacing)) AddTruth(p);
    } else {
      const bool has_views = HasViews(truth_.path);
      ForEachPoint(truth_.path, truth_.min_views, [&](const Vector3d& p, double views) {
        if (AddTruth(p) && has_views) AddViews(views);
      });
    }
    if (result_.clouds.truth.empty())
      throw phi::InputError(truth_.path.string() + " holds no point to compare with");
    for (const Vector3d& scanner : truth_.scanners) AddScan(result_.clouds.truth, scanner);
    const Eigen::Affine3d truth_from_cloud(
        preparation_.truth_from_cloud.value_or(Eigen::Matrix4d::Identity()));
    ForEachPoint(cloud_path, 0, [&](const Vector3d& given, double) {
      const Vector3d p = truth_from_cloud * given;
      if (IsInside(p)) result_.clouds.points.push_back(Relative(p, result_.origin));
    });
    if (preparation_.thin) {
      result_.clouds.points = ThinCloud(result_.clouds.points, voxel_size_);
      result_.clouds.truth = ThinCloud(result_.clouds.truth, voxel_size_);
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
    return true;
  }

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
      ForEachPoint(layer.path, truth_.min_views,
                   [&](const Vector3d& p, double) { AddTruth(world_from_scan * p); });
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

void SampleTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, double spacing,
                    std::vector<Vector3d>& samples) {
  // Rows parallel to bc, from a; row r of n has its own number of samples, so that both spacings hold.
  const double reach = std::max((b - a).norm(), (c - a).norm());
  const int rows = std::max(1, static_cast<int>(std::ceil(reach / spacing)));
  samples.push_back(a);
  for (int r = 1; r <= rows; ++r) {
    const double t = static_cast<double>(r) / rows;
    const Vector3d from = a + t * (b - a), to = a + t * (c - a);
    const int steps = std::max(1, static_cast<int>(std::ceil((to - from).norm() / spacing)));
    for (int s = 0; s <= steps; ++s) samples.push_back(from + (to - from) * (static_cast<double>(s) / steps));
  }
}

std::vector<Vec3f> ThinCloud(const std::vector<Vec3f>& points, double voxel_size) {
  using Cell = std::array<std::int64_t, 3>;
  struct Hash {
    std::size_t operator()(const Cell& cell) const {
      std::uint64_t hash = 0;
      for (const std::int64_t index : cell)
        hash = (hash ^ static_cast<std::uint64_t>(index)) * 0x9e3779b97f4a7c15u;
      return static_cast<std::size_t>(hash ^ hash >> 32);
    }
  };
  struct Sum {
    Vector3d position = Vector3d::Zero();
    double count = 0;
  };
  const auto cell_of = [voxel_size](float x) {
    return static_cast<std::int64_t>(std::floor(x / voxel_size));
  };
  std::unordered_map<Cell, std::size_t, Hash> index_of;
  std::vector<Sum> sums;
  for (const Vec3f& p : points) {
    const auto [entry, is_new] =
        index_of.try_emplace({cell_of(p.x), cell_of(p.y), cell_of(p.z)}, sums.size());
    if (is_new) sums.emplace_back();
    Sum& sum = sums[entry->second];
    sum.position += Vector3d(p.x, p.y, p.z);
    sum.count += 1;
  }
  std::vector<Vec3f> thinned;
  for (const Sum& sum : sums) thinned.push_back(Relative(sum.position / sum.count, Vector3d::Zero()));
  return thinned;
}

LoadedClouds LoadClouds(const std::filesystem::path& cloud_path, const TruthOptions& truth, double voxel_size,
                        bool inferred_apart, const CloudPreparation& preparation) {
  LoadedClouds loaded = Loader(truth, voxel_size, preparation).Load(cloud_path);
  if (inferred_apart) loaded.clouds.inferred = ReadInferred(cloud_path);
  return loaded;
}

}  // namespace colmap_ext
