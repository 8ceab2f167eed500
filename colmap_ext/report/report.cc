#include "colmap_ext/report/report.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <fstream>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/failure_text.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/json_file.h"
#include "colmap_ext/replaced_file.h"
#include "colmap_ext/report/report_cloud.h"
#include "colmap_ext/report/report_images.h"
#include "colmap_ext/report/report_page.h"
#include "colmap_ext/workspace.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using Json = nlohmann::ordered_json;

Json ReadJson(const std::filesystem::path& path) {
  std::ifstream stream = OpenNeededFile(path);
  try {
    return ParseJson(stream);
  } catch (const Json::exception&) {
    throw phi::InputError(phi::AboutFile(path) + " is not JSON; write it again, or move it away");
  } catch (const phi::InputError& error) {
    throw phi::InputError(phi::AboutFile(path) + ": " + error.what());
  }
}

// Pictures are long: they are taken out of the image.
Json ToJson(ReportImage image) {
  Json pictures = Json::array();
  for (ReportPicture& p : image.pictures) {
    pictures.push_back(Json::object());
    pictures.back()["title"] = p.title;
    pictures.back()["uri"] = std::move(p.uri);
    pictures.back()["caption"] = p.caption;
    if (!p.legend.palette.empty())
      pictures.back()["legend"] = {p.legend.palette, p.legend.from, p.legend.to};
  }
  Json histogram = Json::array();
  for (const auto& [bin, count] : image.depth_histogram) histogram.push_back({bin, count});
  Json json = {{"name", image.name},
               {"view", image.view},
               {"width", image.width},
               {"height", image.height},
               {"photometric", image.photometric},
               {"measured", image.measured},
               {"geometric", image.geometric},
               {"filled", image.filled},
               {"depths", {image.near_depth, image.median_depth, image.far_depth}},
               {"pixel_size", image.pixel_size},
               {"depth_histogram", histogram},
               {"warnings", image.warnings}};
  json["pictures"] = std::move(pictures);
  return json;
}

// Which of the run's options somebody chose.
Json ChosenOptions(const Json& options, const std::map<std::string, std::string>& defaults) {
  Json chosen = Json::object();
  for (const auto& [name, value] : options.items()) {
    const auto found = defaults.find(name);
    if (found != defaults.end() && value.is_string() && value.get<std::string>() != found->second)
      chosen[name] = value;
  }
  return chosen;
}

// Of images: a missing photo is a warning of all that would have read it.
void AddWarnings(const std::vector<phi::Message>& warnings, Json& report) {
  for (const std::string& line : LinesByReason(warnings)) report["warnings"].push_back(line);
}

// Sums the tasks of stereo/phimvs.json by kind of result, and collects what they warned of.
void AddRun(const std::filesystem::path& record_path,
            const std::map<std::string, std::string>& default_options, Json& report) {
  const Json record = ReadJson(record_path);
  report["version"] = record.value("version", "");
  report["options"] = record.value("options", Json::object());
  report["chosen_options"] = ChosenOptions(report["options"], default_options);
  report["runs"] = record.value("runs", Json::array());
  Json stages = Json::object();
  std::vector<phi::Message> warnings;
  const Json images = record.value("images", Json::object());
  for (const auto& [image, kinds] : images.items()) {
    for (const auto& [kind, task] : kinds.items()) {
      Json& stage = stages[kind];
      if (stage.is_null()) stage = Json::object();
      const std::string state = task.value("state", "");
      stage["done"] = stage.value("done", 0) + (state == "done" ? 1 : 0);
      stage["failed"] = stage.value("failed", 0) + (state == "failed" ? 1 : 0);
      stage["seconds"] = stage.value("seconds", 0.0) + task.value("seconds", 0.0);
      stage["peak_memory_bytes"] = std::max(stage.value("peak_memory_bytes", std::int64_t{0}),
                                            task.value("peak_memory_bytes", std::int64_t{0}));
      for (const auto& warning : task.value("warnings", Json::array())) {
        warnings.push_back(WithContext(warning.get<std::string>(), phi::AboutImage(image) + phi::AboutStage(kind)));
      }
    }
  }
  report["stages"] = stages;
  AddWarnings(warnings, report);
}

void WarnOfDamagedRecord(const std::string& why, Json& report) {
  report["warnings"].push_back("stereo/phimvs.json is damaged, times and settings are unknown: " + why);
}

// What a report tells is in maps and clouds.
void RequireContent(const Workspace& workspace, const std::vector<ReportImage>& images, const Json& report) {
  const bool has_maps = std::any_of(images.begin(), images.end(), [](const ReportImage& image) {
    return image.photometric >= 0 || image.measured >= 0 || image.geometric >= 0;
  });
  if (has_maps || report.contains("cloud")) return;
  throw phi::InputError(phi::AboutFile(workspace.StereoFolder()) +
                        " holds no depth map of the sparse model's images that can be read, and there is no "
                        "cloud: nothing to report; run phimvs patch_match_stereo first");
}

void AddImages(std::vector<ReportImage> report_images, Json& report) {
  Json images = Json::array();
  std::vector<phi::Message> warnings;
  for (ReportImage& image : report_images) {
    for (const std::string& warning : image.warnings) warnings.push_back(WithContext(warning, phi::AboutImage(image.name)));
    images.push_back(ToJson(std::move(image)));
  }
  report["images"] = std::move(images);
  AddWarnings(warnings, report);
}

void AddEvaluations(const std::vector<std::filesystem::path>& paths, Json& report) {
  for (const auto& path : paths) {
    const Json scores = ReadJson(path);
    if (!scores.contains("tolerances")) {
      throw phi::InputError(phi::AboutFile(path) +
                            " holds no scores of a cloud; write it with phimvs evaluate --cloud_path");
    }
    report["evaluations"].push_back({{"name", path.stem().string()},
                                     {"tolerances", scores["tolerances"]},
                                     {"accuracy", scores.at("accuracy")},
                                     {"completeness", scores.at("completeness")},
                                     {"f1", scores.at("f1")}});
  }
}

// Of the view's frusta, from the cloud's offset: half of the image plane's sides at distance 1 are tan_x and tan_y.
Json CamerasJson(const Workspace& workspace, const std::array<double, 3>& offset) {
  Json cameras = Json::array();
  for (const phi::SceneView& view : workspace.views()) {
    const Eigen::Vector3d c = view.camera.pose.Center() - Eigen::Vector3d(offset[0], offset[1], offset[2]);
    const Eigen::Vector3d up = -view.camera.pose.rotation.row(1), forward = view.camera.pose.rotation.row(2);
    const phi::Pinhole& k = view.camera.pinhole;
    cameras.push_back({{"name", view.name},
                       {"center", {c.x(), c.y(), c.z()}},
                       {"up", {up.x(), up.y(), up.z()}},
                       {"forward", {forward.x(), forward.y(), forward.z()}},
                       {"tan_x", 0.5 * k.width / k.fx},
                       {"tan_y", 0.5 * k.height / k.fy}});
  }
  return cameras;
}

void AddPoints(const ReportOptions& options, const Workspace& workspace, const std::filesystem::path& path, Json& report) {
  CloudSample sample = SampleCloud(path, options.max_points);
  if (!options.truth_depth_maps.empty()) {
    CompareWithTruth(workspace, FindTruthMapsOf(workspace, options.truth_depth_maps), options.values_per_unit, &sample);
  }
  const ReportCloud cloud = PackCloud(sample);
  const CloudCount count = CountCloud(path, sample.num_points);
  report["cloud"] = {{"file", path.string()},
                     {"num_points", count.num_points},
                     {"num_files", count.num_files},
                     {"num_shown", cloud.num_shown},
                     {"center", cloud.center},
                     {"scale", cloud.scale},
                     {"positions", cloud.positions},
                     {"colors", cloud.colors},
                     {"normals", cloud.normals},
                     {"inferred", cloud.inferred},
                     {"confidences", cloud.confidences},
                     {"errors", cloud.errors},
                     {"error_unit", CloudSample::kErrorUnit},
                     {"view_counts", cloud.view_counts},
                     {"views", cloud.views},
                     {"cameras", CamerasJson(workspace, sample.offset)}};
}

// The cloud of another run must not stand for one that cannot be shown.
void AddCloud(const ReportOptions& options, const Workspace& workspace, Json& report) {
  const auto path = options.cloud.empty() ? options.workspace / "fused.ply" : options.cloud;
  if (options.cloud.empty() && !std::filesystem::exists(path)) return;
  if (options.cloud_not_shown.empty()) {
    AddPoints(options, workspace, path, report);
  } else {
    report["cloud_not_shown"] = options.cloud_not_shown.string();
  }
  const std::filesystem::path fusion = path.string() + ".json";
  if (std::filesystem::exists(fusion)) report["fusion"] = ReadJson(fusion);
}

std::string Now() {
  const std::time_t now = std::time(nullptr);
  char text[64];
  std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M UTC", std::gmtime(&now));
  return text;
}

// JSON inside a script element: "</script>" and "<!--" must not occur.
std::string ForScript(const Json& json) {
  const std::string text = DumpJson(json, -1);
  std::string safe;
  safe.reserve(text.size());
  for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
    end = text.find('<', begin);
    safe.append(text, begin, end - begin);
    if (end != std::string::npos) safe += "\\u003c";
  }
  return safe;
}

// The masks that the last run used, where they still are; as given, they may be relative to the folder that it ran in.
std::filesystem::path MaskFolder(const Json& report) {
  const Json options = report.value("options", Json::object());
  const std::string folder = options.value("PhiStereo.mask_path", "");
  return std::filesystem::is_directory(folder) ? folder : "";
}

}  // namespace

std::string ReportOptions::Check() const {
  if (picture_size < 64) return "--picture_size must be at least 64 pixels";
  if (picture_size > 16384) return "--picture_size must be at most 16384 pixels";
  if (max_images < 1) return "--max_images must be at least 1";
  if (max_points < 1) return "--max_points must be at least 1";
  if (!(values_per_unit > 0)) return "--truth_depth_scale must be positive";
  return "";
}

void CheckReportPlace(const std::filesystem::path& output) { RequireReplaceable(output, "<!DOCTYPE html>", "report"); }

void WriteReport(const ReportOptions& options) {
  CheckReportPlace(options.output);
  WorkspaceOptions workspace_options;
  workspace_options.path = options.workspace;
  Json report = {{"workspace", std::filesystem::absolute(options.workspace).lexically_normal().string()},
                 {"written", Now()},
                 {"program", PHIMVS_VERSION},
                 {"warnings", Json::array()},
                 {"evaluations", Json::array()}};
  const auto record = options.workspace / "stereo" / "phimvs.json";
  if (std::filesystem::exists(record)) {
    try {
      AddRun(record, options.default_options, report);
    } catch (const Json::exception& error) {
      WarnOfDamagedRecord(error.what(), report);
    } catch (const phi::InputError& error) {
      WarnOfDamagedRecord(error.what(), report);
    }
  } else {
    report["warnings"].push_back("stereo/phimvs.json is missing: times and settings are unknown");
  }
  workspace_options.mask_path = MaskFolder(report);
  const Workspace workspace(workspace_options);
  Json cloud = Json::object();
  std::vector<ReportImage> images;
  tbb::parallel_invoke([&] { AddCloud(options, workspace, cloud); }, [&] { images = MakeReportImages(workspace, options); });
  report.update(cloud);
  RequireContent(workspace, images, report);
  AddImages(std::move(images), report);
  AddEvaluations(options.evaluations, report);
  WriteFileAtomically(options.output, ReportPage(ForScript(report)));
}

}  // namespace colmap_ext
