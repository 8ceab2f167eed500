// Whatever reads or writes a file names it, as the caller did, where the file is at fault.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/cli/project_file.h"
#include "colmap_ext/compact_codes.h"
#include "colmap_ext/compact_map.h"
#include "colmap_ext/config_lines.h"
#include "colmap_ext/evaluation/crop_volume.h"
#include "colmap_ext/evaluation/meshlab_project.h"
#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/fusion/bounding_box_file.h"
#include "colmap_ext/fusion/part_files.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/pipeline/file_identity.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/task_record.h"
#include "colmap_ext/sparse_model.h"
#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;
using test_support::WriteBytes;

struct FileAction {
  std::string name;
  std::function<void(const fs::path& file)> run;
};

std::string FileAtFault(const FileAction& action, const fs::path& path) {
  return test_support::WholeMessageOf<phi::Error>([&] { action.run(path); }).file;
}

// Absolute, and as somebody names it from where the test runs.
std::vector<fs::path> SpellingsOf(const fs::path& folder) {
  return {folder, folder.lexically_relative(fs::current_path())};
}

TEST(FileErrors, OfADamagedFileCarryItsPath) {
  const std::vector<FileAction> readers = {
      {"map size", [](const fs::path& file) { ReadMapSize(file); }},
      {"depth map", [](const fs::path& file) { ReadDepthMap(file); }},
      {"compact map", [](const fs::path& file) { ReadCompactMap(file); }},
      {"size of a compact map", [](const fs::path& file) { ReadCompactMapSize(file); }},
      {"gray image", [](const fs::path& file) { ReadGrayImage(file); }},
      {"true depths", [](const fs::path& file) { ReadTruthDepth(file, 1000); }},
      {"mask", [](const fs::path& file) { ReadMask(file); }},
      {"bounding box", [](const fs::path& file) { ReadBoundingBox(file); }},
      {"project file", [](const fs::path& file) { ReadProjectFile(file); }},
      {"cloud", [](const fs::path& file) { PlyRows rows(file); }},
      {"part of a fusion", [](const fs::path& file) { ReadPartFindings(file); }},
      {"crop volume", [](const fs::path& file) { ReadCropVolume(file); }},
      {"similarity", [](const fs::path& file) { ReadSimilarity(file); }},
      {"scans", [](const fs::path& file) { ReadMeshLabProject(file); }},
  };
  const TemporaryFolder folder;
  for (const fs::path& spelling : SpellingsOf(folder.path())) {
    const fs::path file = spelling / "my files: 2" / "of me";
    WriteBytes(file, "damaged");
    for (const FileAction& reader : readers) EXPECT_EQ(FileAtFault(reader, file), file.string()) << reader.name;
  }
}

TEST(FileErrors, OfAMissingFileCarryItsPath) {
  const std::vector<FileAction> readers = {
      {"depth map", [](const fs::path& file) { ReadDepthMap(file); }},
      {"compact map", [](const fs::path& file) { ReadCompactMap(file); }},
      {"gray image", [](const fs::path& file) { ReadGrayImage(file); }},
      {"cloud", [](const fs::path& file) { PlyRows rows(file); }},
      {"configuration", [](const fs::path& file) { ReadConfigLines(file); }},
      {"identity", [](const fs::path& file) { IdentifyFile(file); }},
      {"model", [](const fs::path& file) { ReadSparseModel(file); }},
      {"true maps", [](const fs::path& file) { FindTruthMaps(file); }},
  };
  for (const FileAction& reader : readers) EXPECT_EQ(FileAtFault(reader, "no such/file"), "no such/file") << reader.name;
}

TEST(FileErrors, OfAFileThatMustBeThereSayWhatToDo) {
  const std::vector<FileAction> readers = {
      {"bounding box", [](const fs::path& file) { ReadBoundingBox(file); }},
      {"cloud", [](const fs::path& file) { PlyRows rows(file); }},
      {"crop volume", [](const fs::path& file) { ReadCropVolume(file); }},
      {"similarity", [](const fs::path& file) { ReadSimilarity(file); }},
      {"scans", [](const fs::path& file) { ReadMeshLabProject(file); }},
  };
  const TemporaryFolder folder;
  const std::string missing = folder / "none", part = folder.path();
  for (const FileAction& reader : readers) {
    const auto message = [&](const fs::path& path) { return test_support::MessageOf<phi::InputError>([&] { reader.run(path); }); };
    EXPECT_EQ(message(missing), missing + ": cannot be read: No such file or directory; correct the path") << reader.name;
    EXPECT_EQ(message(part), part + ": cannot be read: it is a folder, a pipe or a device; name a file") << reader.name;
  }
  WriteBytes(folder / "cloud.ply", "ply\nformat ascii 1.0\n");
  EXPECT_EQ(test_support::MessageOf<phi::InputError>([&] { PlyRows rows(folder / "cloud.ply"); }),
            (folder / "cloud.ply").string() + " is not a PLY file that can be read: its header is incomplete; copy or write it again");
}

// As Windows' editor and shell may save it: little-endian, with a mark and without, and big-endian.
std::vector<std::string> InUtf16(const std::string& text) {
  std::string little, big;
  for (const char c : text) {
    little += {c, '\0'};
    big += {'\0', c};
  }
  return {"\xFF\xFE" + little, little, "\xFE\xFF" + big};
}

TEST(FileErrors, OfATextInUtf16SaySo) {
  const std::vector<FileAction> readers = {
      {"configuration", [](const fs::path& file) { ReadConfigLines(file); }},
      {"bounding box", [](const fs::path& file) { ReadBoundingBox(file); }},
      {"project file", [](const fs::path& file) { ReadProjectFile(file); }},
      {"similarity", [](const fs::path& file) { ReadSimilarity(file); }},
      {"scans", [](const fs::path& file) { ReadMeshLabProject(file); }},
      {"model", [](const fs::path& file) { ReadSparseModel(file.parent_path()); }},
  };
  const TemporaryFolder folder;
  for (const char* other : {"images.txt", "points3D.txt"}) WriteBytes(folder / other, "");
  const fs::path file = folder / "cameras.txt";
  for (const std::string& text : InUtf16("a.png\r\n0 = 1\r\n")) {
    WriteBytes(file, text);
    for (const FileAction& reader : readers) {
      EXPECT_EQ(test_support::MessageOf<phi::InputError>([&] { reader.run(file); }),
                file.string() + ": this text is in UTF-16, or no text; save it as UTF-8")
          << reader.name;
    }
  }
}

TEST(FileErrors, OfAFileThatCannotBeWrittenCarryItsPath) {
  const std::vector<FileAction> writers = {
      {"any file", [](const fs::path& file) { WriteFileAtomically(file, "text"); }},
      {"depth map", [](const fs::path& file) { WriteDepthMap(file, phi::Array2D<float>(2, 2, 1.0f)); }},
      {"journal", [](const fs::path& file) { AppendLine(file, "line\n"); }},
  };
  for (const FileAction& writer : writers) EXPECT_EQ(FileAtFault(writer, "/proc/no folder/file"), "/proc/no folder/file") << writer.name;
  const TemporaryFolder folder;
  EXPECT_EQ(FileAtFault(writers[0], folder.path()), folder.path().string()) << "a folder";
}

TEST(FileErrors, OfAModelCarryTheOneOfItsFiles) {
  const TemporaryFolder folder;
  for (const std::string extension : {".bin", ".txt"}) {
    for (const char* stem : {"cameras", "images", "points3D"}) WriteBytes(folder / (stem + extension), "damaged");
    const FileAction read{"model", [](const fs::path& path) { ReadSparseModel(path); }};
    EXPECT_EQ(FileAtFault(read, folder.path()), (folder / ("cameras" + extension)).string());
    fs::remove(folder / "cameras.bin");
  }
}

TEST(FileErrors, OfACompactMapWithAGoodHeadCarryItsPath) {
  std::vector<std::uint8_t> bytes =
      EncodeCompactMap(RoundToCompact({phi::PlaneMap(20, 10, {{0.0f, 0.0f, -1.0f}, 2.0f}), phi::StateMap()}));
  std::fill(bytes.end() - 16, bytes.end(), std::uint8_t{0xff});
  const TemporaryFolder folder;
  WriteBytes(folder / "a.map", {bytes.begin(), bytes.end()});
  ASSERT_EQ(ReadCompactMapSize(folder / "a.map").width, 20);
  const FileAction read{"compact map", [](const fs::path& path) { ReadCompactMap(path); }};
  EXPECT_EQ(FileAtFault(read, folder / "a.map"), (folder / "a.map").string());
}

TEST(FileErrors, OfARecordCarryItsPath) {
  const TemporaryFolder folder;
  WriteBytes(folder / "phimvs.json", "{");
  const FileAction read{"record", [](const fs::path& path) { RunRecord record(path); }};
  EXPECT_EQ(FileAtFault(read, folder.path()), (folder / "phimvs.json").string());
}

}  // namespace
}  // namespace colmap_ext
