#include "tests/fuzz/targets.h"

#include <fcntl.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>

#include "colmap_ext/cli/option_parser.h"
#include "colmap_ext/compact_codes.h"
#include "colmap_ext/compact_map.h"
#include "colmap_ext/evaluation/crop_volume.h"
#include "colmap_ext/evaluation/meshlab_project.h"
#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/fusion/bounding_box_file.h"
#include "colmap_ext/fusion_config.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/ply_writer.h"
#include "colmap_ext/rig_frames.h"
#include "colmap_ext/sparse_model.h"
#include "phi/base/error.h"

namespace fuzz {
namespace {

namespace fs = std::filesystem;
using namespace colmap_ext;

// A folder of this process, in memory where the system has such a place.
const fs::path& Folder() {
  static const fs::path folder = [] {
    std::string pattern =
        (fs::exists("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) / "phimvs-fuzz-XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) std::abort();
    std::atexit([] { fs::remove_all(Folder()); });
    return fs::path(pattern);
  }();
  return folder;
}

fs::path WriteFile(const std::string& name, Bytes bytes) {
  const fs::path path = Folder() / name;
  const auto open_file = [&] { return open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600); };
  int file = open_file();
  if (file < 0 && fs::create_directories(path.parent_path())) file = open_file();
  if (file < 0 || write(file, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) std::abort();
  close(file);
  return path;
}

std::string ReadFile(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

template <typename Action>
void Allow(const Action& action) {
  try {
    action();
  } catch (const phi::Error&) {  // the only answer to bad bytes
  }
}

// Three files in one input: each starts with its length in two bytes.
void WriteThree(const char* const (&names)[3], Bytes bytes) {
  for (const char* name : names) {
    std::size_t length = 0;
    if (bytes.size() >= 2) {
      length = std::min<std::size_t>(bytes[0] | bytes[1] << 8, bytes.size() - 2);
      bytes = bytes.subspan(2);
    }
    WriteFile(name, bytes.first(length));
    bytes = bytes.subspan(length);
  }
}

std::string JoinThree(const fs::path& folder, const char* const (&names)[3]) {
  std::string joined;
  for (const char* name : names) {
    const std::string content = ReadFile(folder / fs::path(name).filename());
    joined += {static_cast<char>(content.size() & 255), static_cast<char>(content.size() >> 8)};
    joined += content;
  }
  return joined;
}

SparseModel SmallModel() {
  SparseModel model;
  model.cameras[1] = {1, 1, 32, 24, {30, 31, 16, 12}};
  for (std::uint32_t id = 1; id <= 2; ++id) {
    SparseImage image;
    image.image_id = id;
    image.camera_id = 1;
    image.name = "a/" + std::to_string(id) + ".png";
    image.translation = {0.5 * id, -0.25, 2};
    image.observations = {{1.5, 2.5, 11}, {3.5, 4.5, kInvalidPoint3D}};
    model.images.push_back(image);
  }
  model.points = {SparsePoint{11, {1, -2, 4}, {10, 20, 255}, 0.75, {{1, 0}, {2, 0}}}};
  return model;
}

void RunMap(Bytes bytes) {
  const fs::path path = WriteFile("a.bin", bytes);
  Allow([&] { ReadMapSize(path); });
  Allow([&] { ReadDepthMap(path); });
  Allow([&] { ReadNormalMap(path); });
  Allow([&] { ReadThinnedDepthMap(path, 3); });
  Allow([&] { ReadThinnedNormalMap(path, 3); });
  Allow([&] { ReadPlaneRows(path, path, [](int, const PlaneRow&) {}); });
}

std::vector<std::string> MapSeeds() {
  WriteDepthMap(Folder() / "depth.bin", phi::Array2D<float>(5, 3, 2.5f));
  WriteNormalMap(Folder() / "normal.bin", phi::Array2D<phi::Vec3f>(4, 2, {0, 0, -1}));
  return {ReadFile(Folder() / "depth.bin"), ReadFile(Folder() / "normal.bin"), "3&1&1&"};
}

// What is no error is a map that a stage can take: of depths, directions and states that exist, which rounding again keeps.
void RunCompactMap(Bytes bytes) {
  const fs::path path = WriteFile("a.map", bytes);
  Allow([&] { ReadCompactMapSize(path); });
  Allow([&] {
    const phi::MeasurementMap map = ReadCompactMap(path);
    for (std::size_t i = 0; i < map.size(); ++i) {
      const phi::PlaneHypothesis& plane = map.planes.data()[i];
      const bool has_state = map.states.empty() || map.states.data()[i] != phi::PixelState::kNone;
      const bool is_none = plane.depth == 0 && (map.states.empty() || !has_state);
      const bool is_plane = std::isnormal(plane.depth) && plane.depth > 0 && std::abs(phi::Norm(plane.normal) - 1) < 1e-5;
      if (!is_none && !(is_plane && has_state)) std::abort();
    }
    constexpr std::size_t kFewPixels = 4096;  // to be rounded in a moment
    if (map.size() > kFewPixels) return;
    const phi::MeasurementMap rounded = RoundToCompact(map);
    if (EncodeCompactMap(DecodeCompactMap(EncodeCompactMap(rounded), "a.map")) != EncodeCompactMap(rounded)) std::abort();
  });
}

std::vector<std::string> CompactMapSeeds() {
  std::vector<std::string> seeds;
  for (const bool has_states : {false, true}) {
    phi::MeasurementMap map{phi::PlaneMap(19, 17), {}};
    if (has_states) map.states = phi::StateMap(19, 17);
    const auto add = [&] {
      const std::vector<std::uint8_t> bytes = EncodeCompactMap(RoundToCompact(map));
      seeds.emplace_back(bytes.begin(), bytes.end());
    };
    add();  // nothing but holes, in few bytes
    for (std::size_t i = 0; i < map.size(); i += 1 + i % 3) {
      const float angle = 0.7f * static_cast<float>(i), depth = 1 + static_cast<float>(i * i % 97);
      map.planes.data()[i] = {phi::Normalized({std::cos(angle), std::sin(angle), -0.1f * static_cast<float>(i % 30)}), depth};
      if (has_states) map.states.data()[i] = static_cast<phi::PixelState>(1 + i % 4);
    }
    add();
  }
  return seeds;
}

// What a workspace does: pixels are decoded only for a size that was expected.
void RunImage(Bytes bytes) {
  const fs::path path = WriteFile("a.png", bytes);
  const auto check = [](std::size_t width, std::size_t height) {
    if (width > 512 || height > 512) throw phi::InputError("another size");
  };
  Allow([&] { ReadGrayImage(path, check); });
  Allow([&] { ReadColorImage(path, check); });
}

std::vector<std::string> ImageSeeds() {
  std::vector<std::string> seeds;
  ColorImage image(7, 5, {10, 200, 30});
  image(3, 2) = {255, 0, 128};
  for (const char* name : {"seed.png", "seed.jpg", "seed.bmp", "seed.tif", "seed.ppm"}) {
    WriteColorImage(Folder() / name, image);
    seeds.push_back(ReadFile(Folder() / name));
  }
  WriteMask(Folder() / "mask.png", phi::Mask(6, 4, 255));
  seeds.push_back(ReadFile(Folder() / "mask.png"));
  return seeds;
}

constexpr const char* kBinaryNames[3] = {"binary/cameras.bin", "binary/images.bin", "binary/points3D.bin"};
constexpr const char* kTextNames[3] = {"text/cameras.txt", "text/images.txt", "text/points3D.txt"};

void ReadModel(const fs::path& folder) {
  Allow([&] { ReadSparseModel(folder); });
  Allow([&] {
    ProblemList problems;
    ReadSparseModel(folder, &problems);
  });
}

void RunBinaryModel(Bytes bytes) {
  WriteThree(kBinaryNames, bytes);
  ReadModel(Folder() / "binary");
}
void RunTextModel(Bytes bytes) {
  WriteThree(kTextNames, bytes);
  ReadModel(Folder() / "text");
}
std::vector<std::string> BinaryModelSeeds() {
  WriteSparseModelBinary(SmallModel(), Folder() / "seed");
  return {JoinThree(Folder() / "seed", kBinaryNames)};
}
std::vector<std::string> TextModelSeeds() {
  WriteSparseModelText(SmallModel(), Folder() / "seed");
  return {JoinThree(Folder() / "seed", kTextNames)};
}

void RunPly(Bytes bytes) {
  const fs::path path = WriteFile("a.ply", bytes);
  Allow([&] {
    const PlyRows rows(path);
    Allow([&] { rows.ForEachRow("vertex", {"x", "y", "z", "views"}, [](const double*) {}); });
    if (const PlyElement* vertex = rows.Find("vertex"); vertex && vertex->count > 0) {
      Allow([&] { rows.ForChosenRows("vertex", {"x", "views"}, {vertex->count - 1}, [](const double*) {}); });
    }
    Allow([&] { rows.ForEachList("face", "vertex_indices", [](const std::vector<std::int64_t>&) {}); });
  });
}

std::vector<std::string> PlySeeds() {
  PlyWriter writer(Folder() / "seed.ply", {{"float", "x"}, {"double", "y"}, {"uchar", "views"}},
                   {"offset 1 2 3"});
  const char row[13] = {};
  writer.WriteVertices(row, sizeof(row), 1);
  writer.Commit();
  return {
      ReadFile(Folder() / "seed.ply"),
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 nan\n3 0 1 2\n",
      std::string("ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty short x\n"
                  "property list ushort double l\nend_header\n\0\1\0\1\0\0\0\0\0\0\0\0",
                  110)};
}

// rigs and frames, each with its length; as both forms.
void RunFrames(Bytes bytes) {
  const char* const binary[3] = {"frames/rigs.bin", "frames/frames.bin", "frames/images.bin"};
  const char* const text[3] = {"text_frames/rigs.txt", "text_frames/frames.txt", "text_frames/images.txt"};
  WriteThree(binary, bytes);
  Allow([] { FramesWarning(Folder() / "frames", SmallModel()); });
  WriteThree(text, bytes);
  Allow([] { FramesWarning(Folder() / "text_frames", SmallModel()); });
}

std::vector<std::string> FramesSeeds() {
  const fs::path folder = Folder() / "frames_seed";
  const auto seed = [&](const std::string& rigs, const std::string& frames) {
    fs::create_directories(folder);
    for (const auto& [name, content] : {std::pair{"rigs", rigs}, {"frames", frames}, {"images", std::string()}}) {
      std::ofstream(folder / name, std::ios::binary) << content;
    }
    const char* const names[3] = {"rigs", "frames", "images"};
    return JoinThree(folder, names);
  };
  const std::string one(1, '\1'), zeros(7, '\0'), camera(4, '\0'), id = one + std::string(3, '\0'), pose(56, '\0');
  return {seed(one + zeros + id + id + camera + id, one + zeros + id + id + pose + id + camera + id + one + zeros),
          seed("1 2 CAMERA 1 CAMERA 2 1 1 0 0 0 0.5 0 0\n", "# frames\n1 1 1 0 0 0 1 2 3 2 CAMERA 1 1 CAMERA 2 2\n")};
}

void RunMeshLab(Bytes bytes) {
  const fs::path path = WriteFile("a.mlp", bytes);
  Allow([&] { ReadMeshLabProject(path); });
}

std::vector<std::string> MeshLabSeeds() {
  return {
      "<!DOCTYPE MeshLabDocument><MeshLabProject><MeshGroup><MLMesh label=\"a\" filename=\"a &amp; b.ply\">"
      "<MLMatrix44>0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1</MLMatrix44></MLMesh><MLMesh filename=\"c.ply\"/>"
      "</MeshGroup></MeshLabProject>"};
}

void RunConfig(Bytes bytes) {
  static const Workspace workspace = [] {
    WriteSparseModelBinary(SmallModel(), Folder() / "workspace/sparse");
    return Workspace({.path = Folder() / "workspace"});
  }();
  const fs::path path = WriteFile("a.cfg", bytes);
  Allow([&] { ReadPatchMatchConfig(workspace, path); });
  Allow([&] { ReadFusionConfig(workspace, path); });
  Allow([&] { ReadBoundingBox(path); });
}

std::vector<std::string> ConfigSeeds() {
  return {"# a comment\na/1.png\n__auto__, 20\na/2.png\na/1.png; a/2.png,\n", "a/1.png\n__all__\n",
          "-1 -2 -3\n4 5 6e1\n",
          "\xEF\xBB\xBF"
          "a/2.png\r\n"};
}

void RunCrop(Bytes bytes) {
  const fs::path path = WriteFile("a.json", bytes);
  Allow([&] { ReadCropVolume(path).Contains({0.5, 0.25, 1}); });
  Allow([&] { ReadSimilarity(path); });
}

std::vector<std::string> CropSeeds() {
  return {R"({"axis_max": 3, "axis_min": -1.5e0, "orthogonal_axis": "Y", "class_name": "SelectionPolygonVolume",)"
          R"( "bounding_polygon": [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]})",
          "0 -2 0 1\n2 0 0 2\n0 0 2 3\n0 0 0 1\n"};
}

// The record and its journal, each with its length.
void RunRecordFiles(Bytes bytes) {
  const char* const names[3] = {"record/phimvs.json", "record/phimvs.json.journal", "record/unused"};
  WriteThree(names, bytes);
  Allow([] {
    RunRecord record(Folder() / "record");
    record.Finish({"a", "measured"}, {"done", "key"});
    record.SetOptions({}, "hash");
    record.Compact();
    RunRecord again(Folder() / "record");  // what it wrote it can read
    if (!again.Find("a", "measured")) std::abort();
  });
}

std::vector<std::string> RecordSeeds() {
  const fs::path folder = Folder() / "record_seed";
  fs::remove_all(folder);
  fs::create_directories(folder);
  RunRecord record(folder);
  record.SetOptions({{"log_level", "2"}}, "hash");
  record.Begin({{"a", "measured"}, {"b\\\xE9", "geometric"}}, {"k", "l"});
  record.AddRun("{\"seconds\": 1.5}");
  record.Finish({"a", "measured"}, {"done", "k", 1.5, 1000, {"a warning"}, {{10, 20, "ff"}}});
  const char* const names[3] = {"phimvs.json", "phimvs.json.journal", "unused"};
  return {JoinThree(folder, names)};
}

void ParseOptions(const std::vector<std::string>& arguments) {
  Allow([&] {
    OptionParser parser("fuzz", "");
    int number = 0;
    double real = 0;
    bool flag = false;
    std::string text;
    parser.Add("Group.number", &number, "");
    parser.Add("Group.real", &real, "").ColmapDefault("0.01");
    parser.Add("flag", &flag, "");
    parser.Add("text", &text, "");
    std::vector<const char*> argv = {"fuzz"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    parser.Parse(static_cast<int>(argv.size()), argv.data());
  });
}

void RunProjectFile(Bytes bytes) {
  ParseOptions({"--project_path", WriteFile("a.ini", bytes).string(), "--log_level", "0"});
}

std::vector<std::string> ProjectFileSeeds() {
  return {"log_to_stderr=0\nflag=true\ntext=a b\n[Group]\nnumber=5\nreal=0.0099999997764825821\n# end\n"};
}

// Each line is an argument.
void RunCommandLine(Bytes bytes) {
  std::istringstream lines(std::string(bytes.begin(), bytes.end()));
  std::vector<std::string> arguments;
  for (std::string line; std::getline(lines, line);) arguments.push_back(line);
  std::streambuf* const output = std::cout.rdbuf(nullptr);  // that of --help
  ParseOptions(arguments);
  std::cout.rdbuf(output);
}

std::vector<std::string> CommandLineSeeds() {
  return {"--Group.number\n5\n--flag=true\n--text\na b\n", "--fl\n1\n--Group=2\n", "-h\n", "--help_json\n",
          "--log_level\n3\n--Group.real\n1e-3\n--text="};
}

constexpr Target kTargets[] = {{"map", RunMap, MapSeeds},
                               {"compact_map", RunCompactMap, CompactMapSeeds},
                               {"image", RunImage, ImageSeeds},
                               {"binary_model", RunBinaryModel, BinaryModelSeeds},
                               {"text_model", RunTextModel, TextModelSeeds},
                               {"frames", RunFrames, FramesSeeds},
                               {"ply", RunPly, PlySeeds},
                               {"meshlab", RunMeshLab, MeshLabSeeds},
                               {"config", RunConfig, ConfigSeeds},
                               {"crop", RunCrop, CropSeeds},
                               {"record", RunRecordFiles, RecordSeeds},
                               {"project", RunProjectFile, ProjectFileSeeds},
                               {"command_line", RunCommandLine, CommandLineSeeds}};

}  // namespace

std::span<const Target> Targets() { return kTargets; }

const Target* FindTarget(const std::string& name) {
  for (const Target& target : kTargets) {
    if (name == target.name) return &target;
  }
  return nullptr;
}

}  // namespace fuzz
