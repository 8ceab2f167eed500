#include "colmap_ext/evaluation/score_tables.h"

#include <algorithm>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/json_file.h"

namespace colmap_ext {
namespace {

using Rows = std::vector<std::vector<std::string>>;  // the first row is the heading

std::string Percent(double value) { return FormatText("%.2f", value); }

std::string Table(const Rows& rows, TableFormat format) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  const bool markdown = format == TableFormat::kMarkdown;
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < rows[r].size(); ++c) {
      const std::string padding(widths[c] - rows[r][c].size(), ' ');
      // Names to the left, numbers to the right.
      text += markdown ? "| " : "  ";
      text += c == 0 ? rows[r][c] + padding : padding + rows[r][c];
      if (markdown) text += ' ';
    }
    text += markdown ? "|\n" : "\n";
    if (r == 0 && markdown) {
      for (std::size_t c = 0; c < widths.size(); ++c) {
        text += "|" + std::string(widths[c] + 1, '-') + (c == 0 ? "-" : ":");
      }
      text += "|\n";
    }
  }
  return text;
}

std::string CloudTable(const CloudScores& scores, TableFormat format) {
  Rows rows{{"tolerance", "accuracy %", "completeness %", "F1 %"}};
  for (std::size_t t = 0; t < scores.tolerances.size(); ++t) {
    rows.push_back({FormatText("%g", scores.tolerances[t]), Percent(scores.accuracy[t]),
                    Percent(scores.completeness[t]), Percent(scores.f1[t])});
  }
  std::string counts = std::to_string(scores.num_points) + " points, " + std::to_string(scores.num_counted) +
                       " counted, against " + std::to_string(scores.num_truth) + " points of truth";
  if (scores.accuracy_of_all) {
    rows[0].push_back("accuracy, all truth %");
    for (std::size_t t = 0; t < scores.tolerances.size(); ++t) {
      rows[t + 1].push_back(Percent((*scores.accuracy_of_all)[t]));
    }
  }
  if (scores.measured && scores.inferred) {
    rows[0].insert(rows[0].end(), {"of measured points %", "of inferred points %"});
    for (std::size_t t = 0; t < scores.tolerances.size(); ++t) {
      rows[t + 1].insert(rows[t + 1].end(),
                         {Percent(scores.measured->accuracy[t]), Percent(scores.inferred->accuracy[t])});
    }
    counts += "; accuracy of " + std::to_string(scores.measured->num_counted) + " measured and " +
              std::to_string(scores.inferred->num_counted) + " inferred points";
  }
  return counts + "\n\n" + Table(rows, format);
}

// A row for each number of images that see a true point.
std::string ViewsTable(const CloudScores& scores, TableFormat format) {
  Rows rows{{"seen by", "points of truth"}};
  for (double tolerance : scores.tolerances) rows[0].push_back(FormatText("within %g %%", tolerance));
  for (const ViewsCompleteness& of : scores.by_views) {
    rows.push_back({of.name, std::to_string(of.num_truth)});
    for (double share : of.completeness) rows.back().push_back(Percent(share));
  }
  return Table(rows, format);
}

std::string MapTable(const MapScores& scores, const std::string& unit, TableFormat format) {
  std::vector<std::string> heading{"image", "valid %"};
  for (double threshold : scores.thresholds) heading.push_back("< " + FormatText("%g", threshold) + unit + " %");
  Rows rows{heading};
  const auto add = [&](const MapScore& score) {
    std::vector<std::string> row{score.found ? score.image : score.image + " (no map)", Percent(score.valid)};
    for (double share : score.within) row.push_back(Percent(share));
    rows.push_back(row);
  };
  for (const MapScore& image : scores.images) add(image);
  add(scores.Mean());
  return Table(rows, format);
}

// Percent of the origin's own pixels, by threshold.
std::vector<double> Accuracy(const OriginCount& count) {
  std::vector<double> shares;
  for (std::int64_t n : count.num_within) {
    shares.push_back(
        count.num_pixels > 0 ? 100.0 * static_cast<double>(n) / static_cast<double>(count.num_pixels) : 0.0);
  }
  return shares;
}

// How many of the measured pixels are right, how many of the inferred ones. The last row sums over images.
std::string OriginTable(const MapScores& scores, const std::string& unit, TableFormat format) {
  Rows rows{{"image"}};
  for (const char* origin : {"measured", "inferred"}) {
    rows[0].push_back(std::string(origin) + " pixels");
    for (double threshold : scores.thresholds)
      rows[0].push_back("< " + FormatText("%g", threshold) + unit + " %");
  }
  const auto add = [&](const std::string& name, const MapScore& score) {
    if (!score.measured || !score.inferred) return;  // no map
    rows.push_back({name});
    for (const OriginCount* count : {&*score.measured, &*score.inferred}) {
      rows.back().push_back(std::to_string(count->num_pixels));
      for (double share : Accuracy(*count)) rows.back().push_back(Percent(share));
    }
  };
  for (const MapScore& image : scores.images) add(image.image, image);
  add("all", scores.Mean());
  return Table(rows, format);
}

nlohmann::json ToJson(const OriginCount& count) {
  return {{"num_pixels", count.num_pixels}, {"within", Accuracy(count)}};
}

void AddOrigins(const MapScore& score, nlohmann::json* json) {
  if (score.measured) (*json)["measured"] = ToJson(*score.measured);
  if (score.inferred) (*json)["inferred"] = ToJson(*score.inferred);
}

nlohmann::json ToJson(const MapScore& score) {
  nlohmann::json json{
      {"image", score.image}, {"found", score.found}, {"valid", score.valid}, {"within", score.within}};
  AddOrigins(score, &json);
  return json;
}

nlohmann::json ToJson(const MapScores& scores) {
  nlohmann::json images = nlohmann::json::array();
  for (const MapScore& image : scores.images) images.push_back(ToJson(image));
  const MapScore mean = scores.Mean();
  nlohmann::json json{
      {"thresholds", scores.thresholds}, {"valid", mean.valid}, {"within", mean.within}, {"images", images}};
  AddOrigins(mean, &json);
  return json;
}

nlohmann::json ToJson(const OriginAccuracy& origin) {
  return {{"num_counted", origin.num_counted}, {"accuracy", origin.accuracy}};
}

nlohmann::json ToJson(const ViewsCompleteness& of) {
  return {{"views", of.name},
          {"min_views", of.min_views},
          {"max_views", of.max_views},
          {"num_truth", of.num_truth},
          {"completeness", of.completeness}};
}

}  // namespace

std::string FormatTables(const Evaluation& evaluation, TableFormat format) {
  std::string text;
  const auto add = [&](const std::string& title, const std::string& table) {
    if (!text.empty()) text += "\n";
    text += (format == TableFormat::kMarkdown ? "### " : "") + title + "\n\n" + table;
  };
  if (evaluation.cloud) add("Point cloud", CloudTable(*evaluation.cloud, format));
  if (evaluation.cloud && !evaluation.cloud->by_views.empty()) {
    add("Completeness by the number of images that see a true point", ViewsTable(*evaluation.cloud, format));
  }
  const auto add_maps = [&](const std::string& what, const MapScores& scores, const std::string& unit) {
    add(what + " (share of the pixels with truth)", MapTable(scores, unit, format));
    if (scores.Mean().inferred) {
      add(what + ", measured and inferred pixels apart (share of these)", OriginTable(scores, unit, format));
    }
  };
  if (evaluation.depth) add_maps("Depth maps", *evaluation.depth, "");
  if (evaluation.normals) add_maps("Normal maps", *evaluation.normals, " deg");
  return text;
}

void WriteScoresJson(const std::filesystem::path& path, const Evaluation& evaluation) {
  nlohmann::json json = nlohmann::json::object();
  if (evaluation.cloud) {
    const CloudScores& cloud = *evaluation.cloud;
    json["tolerances"] = cloud.tolerances;
    json["accuracy"] = cloud.accuracy;
    json["completeness"] = cloud.completeness;
    json["f1"] = cloud.f1;
    json["num_points"] = cloud.num_points;
    json["num_counted"] = cloud.num_counted;
    json["num_truth"] = cloud.num_truth;
    if (cloud.accuracy_of_all) json["accuracy_of_all"] = *cloud.accuracy_of_all;
    for (const ViewsCompleteness& of : cloud.by_views) json["by_views"].push_back(ToJson(of));
    if (cloud.measured) json["measured"] = ToJson(*cloud.measured);
    if (cloud.inferred) json["inferred"] = ToJson(*cloud.inferred);
  }
  if (evaluation.depth) json["depth_maps"] = ToJson(*evaluation.depth);
  if (evaluation.normals) json["normal_maps"] = ToJson(*evaluation.normals);
  WriteFileAtomically(path, DumpJson(json, 2) + "\n");
}

}  // namespace colmap_ext
