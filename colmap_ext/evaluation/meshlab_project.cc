#include "colmap_ext/evaluation/meshlab_project.h"

#include <Eigen/Dense>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

bool IsRigid(const Eigen::Matrix4d& m) {
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  return (r * r.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-3) && r.determinant() > 0 &&
         m.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1));
}

std::string Unescape(std::string text) {
  const std::pair<const char*, const char*> entities[] = {
      {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&apos;", "'"}, {"&amp;", "&"}};
  for (const auto& [entity, character] : entities) {
    for (std::size_t at = text.find(entity); at != std::string::npos; at = text.find(entity, at + 1)) {
      text.replace(at, std::string(entity).size(), character);
    }
  }
  return text;
}

}  // namespace

std::vector<MeshLabLayer> ReadMeshLabProject(const std::filesystem::path& path) {
  std::ifstream stream(path);
  if (!stream) throw phi::InputError("cannot read " + path.string());
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};

  static const std::regex kMesh("<MLMesh\\s[^>]*filename=\"([^\"]*)\"");
  static const std::regex kMatrix("<MLMatrix44>([^<]*)</MLMatrix44>");
  std::vector<MeshLabLayer> layers;
  const std::sregex_iterator end;
  for (std::sregex_iterator it(text.begin(), text.end(), kMesh); it != end; ++it) {
    MeshLabLayer layer;
    layer.path = path.parent_path() / Unescape((*it)[1]);  // an absolute name replaces the folder
    const std::size_t begin = static_cast<std::size_t>(it->position());
    const std::size_t next = text.find("<MLMesh ", begin + 1);
    const std::string part = text.substr(begin, next == std::string::npos ? next : next - begin);
    if (std::smatch matrix; std::regex_search(part, matrix, kMatrix)) {
      std::istringstream numbers(matrix[1]);
      for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) numbers >> layer.world_from_layer(row, column);
      }
      if (!numbers || !IsRigid(layer.world_from_layer)) {
        throw phi::InputError(path.string() + ": the matrix of " + layer.path.filename().string() +
                              " is not a rotation and a translation");
      }
    }
    layers.push_back(layer);
  }
  if (layers.empty())
    throw phi::InputError(path.string() + " names no scan (no <MLMesh filename=...> in it)");
  return layers;
}

}  // namespace colmap_ext
