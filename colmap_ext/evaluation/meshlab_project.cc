#include "colmap_ext/evaluation/meshlab_project.h"

#include <Eigen/LU>
#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>

#include "colmap_ext/config_lines.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/text_stream.h"
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

// Projects are read with plain searches: regular expressions of the standard library recurse for every character.
constexpr std::string_view kMesh = "<MLMesh", kSpaces = " \t\r\n";

// Where the next mesh's tag begins, from `at` on; npos: nowhere.
std::size_t FindMesh(std::string_view text, std::size_t at) {
  do {
    at = text.find(kMesh, at);
    if (at == std::string_view::npos) return at;
    at += kMesh.size();
  } while (at >= text.size() || kSpaces.find(text[at]) == std::string_view::npos);
  return at - kMesh.size();
}

// The text between `begin` and the first `end` after it; nothing where either is missing.
std::optional<std::string_view> Between(std::string_view text, std::string_view begin, std::string_view end) {
  const std::size_t at = text.find(begin);
  if (at == std::string_view::npos) return {};
  text.remove_prefix(at + begin.size());
  const std::size_t length = text.find(end);
  if (length == std::string_view::npos) return {};
  return text.substr(0, length);
}

void ReadMatrix(std::string_view part, const std::filesystem::path& project, MeshLabLayer* layer) {
  const auto text = Between(part, "<MLMatrix44>", "</MLMatrix44>");
  if (!text) return;
  TextInput numbers{std::string(*text)};
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) numbers >> layer->world_from_layer(row, column);
  }
  if (!numbers || !IsRigid(layer->world_from_layer)) {
    throw phi::InputError(phi::AboutFile(project) + ": the matrix of " + layer->path.filename().string() +
                          " is not a rotation and a translation");
  }
}

}  // namespace

std::vector<MeshLabLayer> ReadMeshLabProject(const std::filesystem::path& path) {
  std::ifstream stream = OpenNeededFile(path);
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  RequireUtf8(path, text);

  std::vector<MeshLabLayer> layers;
  for (std::size_t begin = FindMesh(text, 0); begin != std::string::npos;) {
    const std::size_t next = FindMesh(text, begin + kMesh.size());
    const std::string_view part = std::string_view(text).substr(begin, next - begin);  // npos: all the rest
    begin = next;
    const auto name = Between(part, "filename=\"", "\"");
    if (!name || name->data() > part.data() + std::min(part.find('>'), part.size())) continue;
    MeshLabLayer layer;
    layer.path = path.parent_path() / Unescape(std::string(*name));  // an absolute name replaces the folder
    ReadMatrix(part, path, &layer);
    layers.push_back(layer);
  }
  if (layers.empty())
    throw phi::InputError(phi::AboutFile(path) + " names no scan (no <MLMesh filename=...> in it)");
  return layers;
}

}  // namespace colmap_ext
