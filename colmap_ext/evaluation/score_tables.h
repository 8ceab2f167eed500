// Scores as text, Markdown and JSON.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "colmap_ext/evaluation/cloud_evaluation.h"
#include "colmap_ext/evaluation/map_evaluation.h"

namespace colmap_ext {

enum class TableFormat { kText, kMarkdown };

// What one run of `phimvs evaluate` compared.
struct Evaluation {
  std::optional<CloudScores> cloud;
  std::optional<MapScores> depth;
  std::optional<MapScores> normals;
};

std::string FormatTables(const Evaluation& evaluation, TableFormat format);

// {"tolerances": [], "accuracy": [], "completeness": [], "f1": [], ...}: percent, indexed by tolerance. Maps
// are under "depth_maps" and "normal_maps"; what was scored apart under "measured" and "inferred"; completeness by
// the number of images that see a true point, where the truth tells it, under "by_views"; accuracy when the
// truth that was left out counts too, under "accuracy_of_all".
void WriteScoresJson(const std::filesystem::path& path, const Evaluation& evaluation);

}  // namespace colmap_ext
