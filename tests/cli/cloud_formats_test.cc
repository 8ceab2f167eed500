// Clouds in the formats that surveyors use, read back by other programs: laspy (PyPI) and Open3D.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "colmap_ext/evaluation/ply_rows.h"
#include "colmap_ext/fusion/cloud_output.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/tile_list.h"
#include "colmap_ext/sparse_model.h"
#include "phi/base/error.h"
#include "tests/support/error_message.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/log_capture.h"
#include "tests/support/map_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kCrs[] = "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\"],UNIT[\"metre\",1]]";

phi::FusedBlock MakeBlock(const std::vector<std::array<double, 3>>& positions) {
  phi::FusedBlock block;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    phi::FusedPoint point;
    for (std::size_t axis = 0; axis < 3; ++axis) point.xyz[axis] = positions[i][axis];
    point.normal[2] = -1;
    point.rgb[0] = 255;
    point.rgb[1] = static_cast<std::uint8_t>(i);
    point.inferred = i % 2;
    point.confidence = 40 + i % 60;
    block.points.push_back(point);
    block.view_counts.push_back(static_cast<std::uint32_t>(2 + i));
    for (std::uint32_t view = 0; view < 2 + i; ++view) block.views.push_back(view);
  }
  return block;
}

template <typename Value>
Value At(const std::string& bytes, std::size_t offset) {
  Value value;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

// Points beyond the reach of 32 bits and the extents are those of the whole, whoever packed the blocks.
TEST(LasCloud, BlocksThatArePreparedInAnyOrderGiveTheBytesOfThoseWrittenOneByOne) {
  const TemporaryFolder folder;
  const auto one_by_one = MakeLasCloudWriter({.path = folder / "a.las"}), prepared = MakeLasCloudWriter({.path = folder / "b.las"});
  const std::vector<phi::FusedBlock> blocks = {MakeBlock({{1, 2, 3}, {3e7, 0, 0}}), MakeBlock({{-4, 5, 6}}),
                                               MakeBlock({{7, -8, 9}, {0, 0, 3e7}})};
  for (const phi::FusedBlock& block : blocks) one_by_one->Write(block);
  const auto last = prepared->Prepare(blocks[1]), first = prepared->Prepare(blocks[0]);
  first();
  last();
  prepared->Write(blocks[2]);
  for (const auto& writer : {one_by_one.get(), prepared.get()}) {
    EXPECT_EQ(writer->num_left_out(), 2u);
    writer->Commit();
  }
  const std::string bytes = ReadBytes(folder / "b.las");
  EXPECT_EQ(bytes, ReadBytes(folder / "a.las"));
  EXPECT_EQ(At<std::uint64_t>(bytes, 247), 3u);
  const double extents[6] = {7, -4, 5, -8, 9, 3};  // largest, least x; y; z
  for (std::size_t i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(At<double>(bytes, 179 + 8 * i), extents[i]) << i;
}

// A millimetre at 10,000 km. Places of the fields: the specification's tables 3 and 16.
TEST(LasCloud, KeepsMillimetresFarFromTheOrigin) {
  const TemporaryFolder folder;
  const std::array<double, 3> offset = {10000000, 5300000, 400};
  const auto writer = MakeLasCloudWriter({.path = folder / "c.las", .scale = 1e-4, .offset = offset, .crs = kCrs});
  writer->Write(MakeBlock({{10000000.001, 5300000.002, 400.003}, {9999999.5, 5300010.25, 401.125}}));
  writer->Commit();
  const std::string bytes = ReadBytes(folder / "c.las");
  EXPECT_EQ(bytes.substr(0, 4), "LASF");
  EXPECT_EQ(bytes[24], 1);
  EXPECT_EQ(bytes[25], 4);
  EXPECT_EQ(At<std::uint16_t>(bytes, 6), 16);  // the coordinate system is WKT
  EXPECT_EQ(At<std::uint16_t>(bytes, 94), 375);  // the header's size
  EXPECT_EQ(At<std::uint32_t>(bytes, 100), 2u);  // records before the points: extra bytes and coordinate system
  EXPECT_EQ(At<std::uint64_t>(bytes, 247), 2u);  // points
  EXPECT_EQ(At<std::uint64_t>(bytes, 255), 2u);  // of these first returns
  const auto data = At<std::uint32_t>(bytes, 96);
  const auto length = At<std::uint16_t>(bytes, 105);
  EXPECT_EQ(length, 40);
  ASSERT_EQ(bytes.size(), data + 2 * length);
  EXPECT_EQ(At<std::int32_t>(bytes, data), 10);
  EXPECT_EQ(At<std::int32_t>(bytes, data + 4), 20);
  EXPECT_EQ(At<std::int32_t>(bytes, data + 8), 30);
  EXPECT_EQ(At<std::uint8_t>(bytes, data + 14), 0x11);
  EXPECT_EQ(At<std::uint16_t>(bytes, data + 30), 0xffff);           // red
  EXPECT_EQ(At<std::uint16_t>(bytes, data + length + 36), 3);       // views of the second point
  EXPECT_EQ(At<std::uint8_t>(bytes, data + length + 38), 1);        // inferred
  EXPECT_EQ(At<std::uint8_t>(bytes, data + length + 39), 41);       // confidence
  const double extents[6] = {10000000.001, 9999999.5, 5300010.25, 5300000.002, 401.125, 400.003};  // largest, least x; y; z
  for (std::size_t i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(At<double>(bytes, 179 + 8 * i), extents[i]) << i;
  EXPECT_THAT(bytes.substr(375, data - 375), HasSubstr(kCrs));
}

TEST(LasCloud, LeavesOutWhatItsIntegersDoNotReach) {
  const TemporaryFolder folder;
  const auto writer = MakeLasCloudWriter({.path = folder / "c.las", .scale = 1e-4});
  writer->Write(MakeBlock({{1, 2, 3}, {0, 3e5, 0}}));
  EXPECT_EQ(writer->num_left_out(), 1u);
  writer->Commit();
  EXPECT_EQ(At<std::uint64_t>(ReadBytes(folder / "c.las"), 247), 1u);
}

TEST(PlyCloud, HoldsDoublesWhereFloatsAreTooCoarse) {
  const TemporaryFolder folder;
  const auto writer = MakePlyCloudWriter({.path = folder / "c.ply", .in_doubles = true});
  writer->Write(MakeBlock({{123456.000123, -1, 2}}));
  writer->Commit();
  PlyRows(folder / "c.ply").ForEachRow("vertex", {"x", "nz", "views", "confidence"}, [&](const double* row) {
    EXPECT_DOUBLE_EQ(row[0], 123456.000123);
    EXPECT_EQ(row[1], -1);
    EXPECT_EQ(row[2], 2);
    EXPECT_EQ(row[3], 40);
  });
}

// Blocks of `size` points, the first of each with a position of its own.
std::vector<phi::FusedBlock> MakeBlocks(int count, std::size_t size) {
  std::vector<phi::FusedBlock> blocks;
  for (int i = 0; i < count; ++i) {
    blocks.push_back(MakeBlock({{1.0 * i, 2, 3}, {0.5 * i, 1, 1}}));
    blocks.back().points.resize(size, blocks.back().points.front());
    blocks.back().view_counts.resize(size, 1);
    blocks.back().views.resize(blocks.back().views.size() + size - 2, static_cast<std::uint32_t>(i));
  }
  return blocks;
}

// Files of 250 points, so that some blocks of 100 lie in two.
TEST(PlyCloud, BlocksThatArePreparedInAnyOrderGiveTheBytesOfThoseWrittenOneByOne) {
  const TemporaryFolder folder;
  const auto make = [&](const char* name) { return MakePlyCloudWriter({.path = folder / name / "c.ply", .max_points_per_file = 250}); };
  const auto one_by_one = make("a"), prepared = make("b");
  const std::vector<phi::FusedBlock> blocks = MakeBlocks(9, 100);
  for (const phi::FusedBlock& block : blocks) one_by_one->Write(block);
  std::vector<std::function<void()>> writes(8);
  for (std::size_t i = writes.size(); i-- > 0;) writes[i] = prepared->Prepare(blocks[i]);
  for (const auto& write : writes) write();
  prepared->Write(blocks[8]);
  for (const auto& writer : {one_by_one.get(), prepared.get()}) writer->Commit();
  for (const char* name : {"c.ply", "c.ply.vis", "c_2.ply", "c_2.ply.vis", "c_4.ply", "c_4.ply.vis"}) {
    EXPECT_EQ(ReadBytes(folder / "a" / name), ReadBytes(folder / "b" / name)) << name;
  }
  EXPECT_EQ(At<std::uint64_t>(ReadBytes(folder / "b/c_4.ply.vis"), 0), 150u);
}

// Ids count the points of all blocks before.
TEST(SparseCloud, BlocksThatArePreparedInAnyOrderGiveTheBytesOfThoseWrittenOneByOne) {
  const TemporaryFolder folder;
  const std::vector<phi::FusedBlock> blocks = MakeBlocks(3, 4);
  for (const auto& [format, name] : {std::pair{SparseFormat::kBinary, "points3D.bin"}, std::pair{SparseFormat::kText, "points3D.txt"}}) {
    const SparseModel model;
    const auto one_by_one = MakeSparseCloudWriter(model, folder / "a", format);
    const auto prepared = MakeSparseCloudWriter(model, folder / "b", format);
    for (const phi::FusedBlock& block : blocks) one_by_one->Write(block);
    const auto last = prepared->Prepare(blocks[1]), first = prepared->Prepare(blocks[0]);
    first();
    last();
    prepared->Write(blocks[2]);
    for (const auto& writer : {one_by_one.get(), prepared.get()}) writer->Commit();
    EXPECT_EQ(ReadBytes(folder / "a" / name), ReadBytes(folder / "b" / name)) << name;
  }
  const std::string bytes = ReadBytes(folder / "b/points3D.bin");
  ASSERT_EQ(bytes.size(), 8u + 12 * 51);
  EXPECT_EQ(At<std::uint64_t>(bytes, 8 + 11 * 51), 12u);
  EXPECT_THAT(ReadBytes(folder / "b/points3D.txt"), testing::EndsWith("\n10 1 1 1 255 1 0 -1\n11 2 2 3 255 0 0 -1\n12 2 2 3 255 0 0 -1\n"));
}

// The names that files of a folder get while `action` runs, in order.
std::vector<std::string> NamesGiven(const fs::path& folder, const std::function<void()>& action) {
  const int watch = ::inotify_init1(IN_NONBLOCK);
  EXPECT_GE(::inotify_add_watch(watch, folder.c_str(), IN_MOVED_TO), 0);
  action();
  std::vector<std::string> names;
  alignas(inotify_event) char bytes[4096];
  for (ssize_t size = 0; (size = ::read(watch, bytes, sizeof(bytes))) > 0;) {
    for (const char* at = bytes; at < bytes + size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(at);
      names.emplace_back(event->name);
      at += sizeof(*event) + event->len;
    }
  }
  ::close(watch);
  return names;
}

// A kill between two names leaves the old points or the new ones; where there were none, no cameras and images without points.
TEST(SparseCloud, ItsPointsHaveTheirNameOnceAndFirst) {
  const TemporaryFolder folder;
  const std::vector<phi::FusedBlock> blocks = MakeBlocks(1, 4);
  const SparseModel model;
  for (const auto& [format, suffix] : {std::pair{SparseFormat::kBinary, std::string(".bin")}, {SparseFormat::kText, ".txt"}}) {
    const auto writer = MakeSparseCloudWriter(model, folder.path(), format);
    writer->Write(blocks[0]);
    EXPECT_THAT(NamesGiven(folder.path(), [&] { writer->Commit(); }),
                ElementsAre("points3D" + suffix, "cameras" + suffix, "images" + suffix));
  }
}

void WritePrepared(int num_blocks, std::unique_ptr<CloudWriter> writer) {
  for (phi::FusedBlock& block : MakeBlocks(num_blocks, 20000)) writer->Prepare(std::move(block))();
  writer->Commit();
}

TEST(CloudWriters, AFullDiskIsToldOfAndNothingIsLeft) {
  const TemporaryFolder folder;
  for (const int num_blocks : {3, 100}) {  // told of by the last step, and while blocks are still coming
    const test_support::FileSizeLimit limit(1000000);
    const auto told = [&](const auto& write) { return test_support::MessageOf<phi::ResourceError>(write); };
    const std::string ply = told([&] { WritePrepared(num_blocks, MakePlyCloudWriter({.path = folder / "c.ply"})); });
    const std::string las = told([&] { WritePrepared(num_blocks, MakeLasCloudWriter({.path = folder / "c.las"})); });
    EXPECT_THAT(ply, AllOf(HasSubstr("c.ply"), HasSubstr("free some space")));
    EXPECT_THAT(las, AllOf(HasSubstr("c.las"), HasSubstr("free some space")));
    EXPECT_TRUE(fs::is_empty(folder.path())) << num_blocks;
  }
  WritePrepared(3, MakePlyCloudWriter({.path = folder / "c.ply"}));
  EXPECT_EQ(fs::file_size(folder / "c.ply.vis"), 8u + 3 * (4 * 20000 + 4 * (2 + 3) + 4 * 19998));
}

TEST(TiledCloud, AFileForEachSquareAndAnIndex) {
  const TemporaryFolder folder;
  const auto writer = MakeTiledCloudWriter({.path = folder / "c.ply", .size = 10}, [](const fs::path& path) {
    return MakePlyCloudWriter({.path = path});
  });
  writer->Write(MakeBlock({{1, 1, 0}, {-1, 1, 5}, {9, 9, 1}, {10, 1, 0}}));
  writer->Commit();
  const auto index = nlohmann::json::parse(ReadBytes(folder / "c.tiles.json"));
  ASSERT_EQ(index["tiles"].size(), 3u);
  EXPECT_EQ(index["tiles"][0]["file"], "c_-1_0.ply");
  EXPECT_EQ(index["tiles"][1]["file"], "c_0_0.ply");
  EXPECT_EQ(index["tiles"][1]["points"], 2);
  EXPECT_EQ(index["tiles"][1]["max"], (std::vector<double>{9, 9, 1}));
  std::vector<double> views;
  PlyRows(folder / "c_0_0.ply").ForEachRow("vertex", {"views"}, [&](const double* row) { views.push_back(row[0]); });
  EXPECT_EQ(views, (std::vector<double>{2, 4}));  // the views stay with their points
  // Count, then of each point the number of its views and their indices.
  EXPECT_EQ(ReadBytes(folder / "c_0_0.ply.vis").size(), 8u + 4 * (1 + 2) + 4 * (1 + 4));
}

std::unique_ptr<CloudWriter> MakeTiles(const fs::path& cloud, double size, const std::shared_ptr<WriteQueues>& queues) {
  return MakeTiledCloudWriter({.path = cloud, .size = size}, [queues](const fs::path& path) {
    return path.extension() == ".las" ? MakeLasCloudWriter({.path = path, .queues = queues})
                                      : MakePlyCloudWriter({.path = path, .max_points_per_file = 8, .queues = queues});
  });
}

// Tile i % num_tiles has point i; blocks begin at each tile in turn.
std::vector<phi::FusedBlock> BlocksOverTiles(int num_blocks, int num_tiles) {
  std::vector<phi::FusedBlock> blocks;
  for (int b = 0; b < num_blocks; ++b) {
    std::vector<std::array<double, 3>> positions;
    for (int i = 0; i < 2 * num_tiles; ++i) positions.push_back({0.5 + (b + i) % num_tiles, 0.25, 0.125 * b});
    blocks.push_back(MakeBlock(positions));
  }
  return blocks;
}

std::map<std::string, std::string> FilesIn(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) files[entry.path().filename().string()] = ReadBytes(entry.path());
  return files;
}

TEST(TiledCloud, TilesThatAreClosedNowAndThenHaveTheSameBytes) {
  for (const char* name : {"t.ply", "t.las"}) {
    const auto write = [&](std::size_t max_open_files) {
      const TemporaryFolder folder;
      {
        const auto writer = MakeTiles(folder / name, 1, MakeQueuesOfTiles(max_open_files));
        for (phi::FusedBlock& block : BlocksOverTiles(6, 20)) writer->Write(std::move(block));
        writer->Commit();
      }
      return FilesIn(folder.path());
    };
    const auto all_open = write(1000);
    EXPECT_EQ(all_open.size(), std::string_view(name) == "t.ply" ? 20u * 2 * 2 + 1 : 20u + 1);
    EXPECT_TRUE(write(3) == all_open) << name;
    EXPECT_TRUE(write(1) == all_open) << name;
  }
}

// Also to be completed and named; the points' or the views' files alone would be too many.
TEST(TiledCloud, ThereMayBeMoreTilesThanOpenFiles) {
  constexpr int kNumTiles = 150;
  const TemporaryFolder folder;
  rlimit before = {};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit few = {140, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  {
    const auto writer = MakeTiles(folder / "t.ply", 1, MakeQueuesOfTiles(40));
    for (phi::FusedBlock& block : BlocksOverTiles(2, kNumTiles)) writer->Write(std::move(block));
    writer->Commit();
    EXPECT_EQ(writer->num_files(), std::size_t{kNumTiles});
  }
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(FilesIn(folder.path()).size(), 2u * kNumTiles + 1);
  EXPECT_EQ(PlyRows(folder / "t_149_0.ply").Find("vertex")->count, 4u);
}

TEST(TiledCloud, AFullDiskLeavesNothingOfTilesThatAreClosed) {
  for (const char* name : {"t.ply", "t.las"}) {
    const TemporaryFolder folder;
    {
      const auto writer = MakeTiles(folder / name, 1, MakeQueuesOfTiles(2));
      const test_support::FileSizeLimit limit(600);
      EXPECT_THAT(test_support::MessageOf<phi::ResourceError>([&] {
                    for (phi::FusedBlock& block : BlocksOverTiles(20, 10)) writer->Write(std::move(block));
                    writer->Commit();
                  }),
                  AllOf(HasSubstr("t_"), HasSubstr("free some space")));
    }
    EXPECT_TRUE(fs::is_empty(folder.path())) << name;
  }
}

// Tiles of 10 units, a list that somebody edited, then of 100: what `t_*.ply` names is one cloud.
TEST(TiledCloud, AnotherSizeLeavesNoTileOfTheLastAndTouchesNothingElse) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "out");
  const fs::path out = folder / "out";
  const auto write = [&](const char* name, double size) {
    const auto writer = MakeTiledCloudWriter({.path = out / name, .size = size}, [](const fs::path& path) {
      return MakePlyCloudWriter({.path = path});
    });
    writer->Write(MakeBlock({{1, 1, 0}, {15, 1, 5}, {-1, 1, 1}}));
    writer->Commit();
  };
  write("t.ply", 10);
  write("other.ply", 10);
  for (const char* kept : {"out/notes.ply", "out/t_7_7.ply", "t_5_5.ply"}) test_support::WriteBytes(folder / kept, "kept");
  fs::create_directory(out / "t_6_6.ply");
  auto list = nlohmann::json::parse(ReadBytes(out / "t.tiles.json"));
  list["tiles"].push_back({{"file", "notes.ply"}, {"column", 7}, {"row", 7}});
  list["tiles"].push_back({{"file", "../t_5_5.ply"}, {"column", 5}, {"row", 5}});
  list["tiles"].push_back({{"file", "t_6_6.ply"}, {"column", 6}, {"row", 6}});
  test_support::WriteBytes(out / "t.tiles.json", list.dump());
  write("t.ply", 100);
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(out)) names.push_back(entry.path().filename());
  EXPECT_THAT(names, testing::UnorderedElementsAre("t.tiles.json", "t_-1_0.ply", "t_-1_0.ply.vis", "t_0_0.ply", "t_0_0.ply.vis",
                                                   "other.tiles.json", "other_-1_0.ply", "other_-1_0.ply.vis", "other_0_0.ply",
                                                   "other_0_0.ply.vis", "other_1_0.ply", "other_1_0.ply.vis", "notes.ply",
                                                   "t_7_7.ply", "t_6_6.ply"));
  EXPECT_EQ(ReadBytes(folder / "t_5_5.ply"), "kept");
  EXPECT_EQ(PlyRows(out / "t_0_0.ply").Find("vertex")->count, 2u);
}

// A cloud whose third tile cannot get its name, as where a run is killed then: nobody would know of the first two.
TEST(TiledCloud, ARunThatWasStoppedLeavesNoTileBesideThoseOfAnotherSize) {
  struct Stopped : std::exception {};
  class Stops : public CloudWriter {
   public:
    void Write(phi::FusedBlock) override {}
    void Commit() override { throw Stopped(); }
  };
  const TemporaryFolder folder;
  const auto write = [&](double size, bool stops, const char* name = "t.ply") {
    int num_tiles = 0;
    const auto writer =
        MakeTiledCloudWriter({.path = folder / name, .size = size}, [&](const fs::path& path) -> std::unique_ptr<CloudWriter> {
          if (stops && ++num_tiles == 3) return std::make_unique<Stops>();
          return MakePlyCloudWriter({.path = path});
        });
    writer->Write(MakeBlock({{1, 1, 0}, {11, 1, 5}, {21, 1, 1}}));
    writer->Commit();
  };
  const auto names = [&] {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder.path())) found.push_back(entry.path().filename());
    return found;
  };
  for (int i = 0; i < 2; ++i) EXPECT_THROW(write(i == 0 ? 1 : 10, true), Stopped);
  EXPECT_THAT(names(), testing::Not(testing::Contains("t_1_1.ply")));
  write(100, false);
  EXPECT_THAT(names(), testing::UnorderedElementsAre("t.tiles.json", "t_0_0.ply", "t_0_0.ply.vis"));
  EXPECT_THROW(write(1, true), Stopped);
  RemoveListedTiles(folder / "t.ply");
  EXPECT_THAT(names(), testing::IsEmpty());
}

// The second tile does not find its place, which is known when its last points are written.
TEST(TiledCloud, AFullDiskAtTheEndLeavesNoTile) {
  const TemporaryFolder folder;
  std::vector<std::array<double, 3>> points = {{1, 1, 0}};
  points.resize(100, {11, 1, 0});
  for (const char* name : {"t.ply", "t.las"}) {
    const auto writer = MakeTiledCloudWriter({.path = folder / name, .size = 10}, [](const fs::path& path) {
      return path.extension() == ".las" ? MakeLasCloudWriter({.path = path}) : MakePlyCloudWriter({.path = path});
    });
    writer->Write(MakeBlock(points));
    const test_support::FileSizeLimit limit(2000);
    EXPECT_THAT(test_support::MessageOf<phi::ResourceError>([&] { writer->Commit(); }), HasSubstr("t_1_0"));
    const auto is_visible = [](const fs::directory_entry& entry) { return !entry.path().filename().native().starts_with('.'); };
    EXPECT_EQ(std::count_if(fs::directory_iterator(folder.path()), fs::directory_iterator(), is_visible), 0) << name;
  }
}

TEST(TiledCloud, AListThatIsNoneIsReplacedWithAWarning) {
  for (const char* damaged : {"{", "{}", "[1]", R"({"tiles": [{"file": 3}]})"}) {
    const TemporaryFolder folder;
    const test_support::LogCapture log;
    test_support::WriteBytes(folder / "t.tiles.json", damaged);
    test_support::WriteBytes(folder / "t_9_9.ply", "kept");
    const auto writer = MakeTiledCloudWriter({.path = folder / "t.ply", .size = 1}, [](const fs::path& path) {
      return MakePlyCloudWriter({.path = path});
    });
    writer->Write(MakeBlock({{0.5, 0.5, 0}}));
    writer->Commit();
    EXPECT_THAT(log.messages(), testing::Contains(HasSubstr("t.tiles.json: this list of tiles is damaged"))) << damaged;
    EXPECT_EQ(nlohmann::json::parse(ReadBytes(folder / "t.tiles.json"))["tiles"][0]["file"], "t_0_0.ply");
    EXPECT_EQ(ReadBytes(folder / "t_9_9.ply"), "kept");
  }
}

// Their places would overflow 64 bits and all points fall into one tile.
TEST(TiledCloud, ASizeThatNoCoordinateCanTellApartIsRefused) {
  const TemporaryFolder folder;
  for (const double size : {1e-17, 1e-30, 5e-324}) {
    const auto writer = MakeTiledCloudWriter({.path = folder / "c.ply", .size = size}, [](const fs::path& path) {
      return MakePlyCloudWriter({.path = path});
    });
    EXPECT_THAT(test_support::MessageOf<phi::InputError>([&] { writer->Write(MakeBlock({{-1.5, 0, 0}, {2.5, 0, 0}})); }),
                HasSubstr("finer than the points' coordinates"))
        << size;
  }
}

// 32 bits at this scale reach 2147 km. Of the first tile one point is beyond them, of the second the only one.
TEST(TiledCloud, WhatAFormatCannotHoldIsInNoBoundsAndMakesNoTile) {
  const TemporaryFolder folder;
  const auto writer = MakeTiledCloudWriter({.path = folder / "t.las", .size = 100}, [](const fs::path& path) {
    return MakeLasCloudWriter({.path = path});
  });
  writer->Write(MakeBlock({{1, 2, 3}, {4, 5, 6}, {7, 8, 3e6}, {150, 1, -3e6}}));
  EXPECT_EQ(writer->num_left_out(), 2u);
  EXPECT_EQ(writer->num_files(), 1u);
  writer->Commit();
  const auto list = nlohmann::json::parse(ReadBytes(folder / "t.tiles.json"));
  ASSERT_EQ(list["tiles"].size(), 1u);
  const auto& tile = list["tiles"][0];
  EXPECT_EQ(tile["file"], "t_0_0.las");
  EXPECT_EQ(tile["points"], 2);
  EXPECT_EQ(tile["min"], (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(tile["max"], (std::vector<double>{4, 5, 6}));
  const auto is_las = [](const fs::directory_entry& entry) { return entry.path().extension() == ".las"; };
  EXPECT_EQ(std::count_if(fs::directory_iterator(folder.path()), fs::directory_iterator(), is_las), 1);
}

class CloudFormats : public testing::Test {
 protected:
  CloudFormats() {
    auto scene = test_support::PlaneScene();
    Similarity shift;
    shift.translation = {500000, 5300000, 400};
    Transform(shift, &scene);
    test_support::WriteMapWorkspace(scene, folder_.path());
  }
  test_support::ProgramResult Fuse(const fs::path& output, std::vector<std::string> more = {}) {
    std::vector<std::string> command = {PHIMVS_BINARY,   "stereo_fusion", "--workspace_path", folder_.path(),
                                        "--output_path", output};
    command.insert(command.end(), more.begin(), more.end());
    return RunProgram(command);
  }
  TemporaryFolder folder_;
};

// Without sparse points, so that LAS states positions in millimetres: 2147 km at most.
class CloudsBeyondLas : public CloudFormats {
 protected:
  void Enlarge(double scale) {
    auto scene = test_support::PlaneScene();
    Transform({.scale = scale}, &scene);
    test_support::WriteMapWorkspace(scene, folder_.path());
    SparseModel model = ReadSparseModel(folder_ / "sparse");
    model.points.clear();
    for (SparseImage& image : model.images) image.observations.clear();
    WriteSparseModelBinary(model, folder_ / "sparse");
  }
  std::uint64_t NumWritten() const { return At<std::uint64_t>(ReadBytes(folder_ / "c.las"), 247); }
};

// Of one file as much as of a hundred tiles.
TEST_F(CloudFormats, TilesShareTheThreadsThatWrite) {
  const auto num_threads = [] { return std::distance(fs::directory_iterator("/proc/self/task"), fs::directory_iterator()); };
  const Workspace workspace({.path = folder_.path()});
  std::vector<std::array<double, 3>> points;
  for (int i = 0; i < 100; ++i) points.push_back({500000.5 + i, 5300000, 400});
  for (const CloudType type : {CloudType::kPly, CloudType::kLas}) {
    const fs::path path = folder_ / (type == CloudType::kPly ? "c.ply" : "c.las");
    const auto before = num_threads();
    const auto writer = MakeCloudWriter(workspace, {.path = path, .type = type, .crs = {}, .tile_size = 1});
    for (int k = 0; k < 3; ++k) writer->Write(MakeBlock(points));
    EXPECT_LE(num_threads(), before + 2);
    writer->Commit();
    const auto index = nlohmann::json::parse(ReadBytes(TileListPath(path)));
    ASSERT_EQ(index["tiles"].size(), 100u);
    EXPECT_EQ(index["tiles"][0]["points"], 3);
    if (type == CloudType::kLas) continue;
    EXPECT_EQ(At<std::uint64_t>(ReadBytes(folder_ / "c_500099_5300000.ply.vis"), 0), 3u);
  }
}

TEST_F(CloudFormats, OfManyTilesSomeAreOpen) {
  const auto num_open = [] { return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()); };
  std::vector<std::array<double, 3>> points;
  for (int i = 0; i < 450; ++i) points.push_back({500000.5 + i, 5300000, 400});
  const auto before = num_open();
  const Workspace workspace({.path = folder_.path()});
  const auto writer = MakeCloudWriter(workspace, {.path = folder_ / "c.las", .type = CloudType::kLas, .crs = {}, .tile_size = 1});
  writer->Write(MakeBlock(points));
  EXPECT_LE(num_open(), before + 402);
  EXPECT_EQ(writer->num_files(), 450u);
}

TEST_F(CloudFormats, ASizeThatMakesTenThousandsOfTilesIsAWarning) {
  SparseModel model = ReadSparseModel(folder_ / "sparse");
  for (SparseImage& image : model.images) image.observations.clear();
  model.points.assign(10100, {});
  for (std::size_t i = 0; i < model.points.size(); ++i) model.points[i].xyz = {5e5 + static_cast<double>(i), 5.3e6, 400};
  WriteSparseModelBinary(model, folder_ / "sparse");
  const Workspace workspace({.path = folder_.path()});
  for (const double size : {1.0, 2.0}) {
    const test_support::LogCapture log;
    MakeCloudWriter(workspace, {.path = folder_ / "c.las", .type = CloudType::kLas, .crs = {}, .tile_size = size});
    const auto messages = log.messages();
    const auto is_warning = [](const std::string& m) { return m.find("lie on more than 10000 tiles") != std::string::npos; };
    EXPECT_EQ(std::count_if(messages.begin(), messages.end(), is_warning), size == 1.0 ? 1 : 0) << size;
  }
}

// Tiles are given up while the threads still have something to write to them.
TEST_F(CloudFormats, AFullDiskLeavesNoTile) {
  const Workspace workspace({.path = folder_.path()});
  const CloudOutput output{.path = folder_ / "out/c.ply", .type = CloudType::kPly, .crs = {}, .tile_size = 1e6};
  for (const int num_blocks : {3, 100}) {
    const test_support::FileSizeLimit limit(1000000);
    EXPECT_THAT(test_support::MessageOf<phi::ResourceError>([&] { WritePrepared(num_blocks, MakeCloudWriter(workspace, output)); }),
                AllOf(HasSubstr("c_0_0.ply"), HasSubstr("free some space")));
    EXPECT_TRUE(fs::is_empty(folder_ / "out")) << num_blocks;
  }
}

TEST_F(CloudsBeyondLas, PointsThatAreLeftOutAreNotCounted) {
  Enlarge(5.3e5);  // the slanted plane is 2120 km away in the middle of view 0
  const auto result = Fuse(folder_ / "c.las");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("points are farther"));
  const std::uint64_t num_written = NumWritten();
  EXPECT_GT(num_written, 0u);
  EXPECT_THAT(result.errors, HasSubstr("c.las: " + std::to_string(num_written) + " points from 5 images"));
  EXPECT_EQ(nlohmann::json::parse(ReadBytes(folder_ / "c.las.json"))["points"], num_written);
  const auto tiled = Fuse(folder_ / "t.las", {"--tile_size", "1e6"});
  ASSERT_EQ(tiled.exit_code, 0);
  std::uint64_t num_in_tiles = 0;
  const auto index = nlohmann::json::parse(ReadBytes(folder_ / "t.tiles.json"));
  for (const auto& tile : index["tiles"]) num_in_tiles += tile["points"].get<std::uint64_t>();
  EXPECT_EQ(num_in_tiles, num_written);
  EXPECT_THAT(tiled.errors, HasSubstr(" in " + std::to_string(index["tiles"].size()) + " tiles from "));
  const std::size_t warning = tiled.errors.find("points are farther");
  ASSERT_NE(warning, std::string::npos);
  EXPECT_EQ(tiled.errors.find("points are farther", warning + 1), std::string::npos) << "once for all tiles";
}

TEST_F(CloudsBeyondLas, ToLoseAllPointsIsAnError) {
  Enlarge(5e6);
  const auto result = Fuse(folder_ / "c.las");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("c.las: all "));
  EXPECT_THAT(result.errors, HasSubstr(".ply"));
  EXPECT_FALSE(fs::exists(folder_ / "c.las"));
  EXPECT_EQ(Fuse(folder_ / "c.ply").exit_code, 0);
}

// A model of images alone, as of poses that were given.
TEST_F(CloudFormats, FarFromTheOriginWithoutSparsePoints) {
  SparseModel model = ReadSparseModel(folder_ / "sparse");
  model.points.clear();
  for (SparseImage& image : model.images) image.observations.clear();
  WriteSparseModelBinary(model, folder_ / "sparse");
  ASSERT_EQ(Fuse(folder_ / "c.las").exit_code, 0);
  EXPECT_GT(At<std::uint64_t>(ReadBytes(folder_ / "c.las"), 247), 160u * 120);
  ASSERT_EQ(Fuse(folder_ / "c.ply").exit_code, 0);
  EXPECT_THAT(ReadBytes(folder_ / "c.ply").substr(0, 200), HasSubstr("comment offset 500000 5300000 400"));
}

TEST_F(CloudFormats, TheSuffixChooses) {
  EXPECT_EQ(Fuse(folder_ / "c.las").exit_code, 0);
  EXPECT_EQ(ReadBytes(folder_ / "c.las").substr(0, 4), "LASF");
  const auto unknown = Fuse(folder_ / "c.xyz");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.errors, HasSubstr("'.xyz'; name the file .ply or .las"));
  EXPECT_FALSE(fs::exists(folder_ / "c.xyz"));
  EXPECT_EQ(Fuse(folder_ / "d.las", {"--output_type", "PLY"}).exit_code, 1);
  const auto code = Fuse(folder_ / "e.las", {"--crs", "EPSG:25832"});
  EXPECT_EQ(code.exit_code, 1);
  EXPECT_THAT(code.errors, HasSubstr("gdalsrsinfo"));
  const auto tiled = Fuse(folder_ / "f.ply", {"--tile_size", "1000"});
  EXPECT_EQ(tiled.exit_code, 0);
  const auto list = nlohmann::json::parse(ReadBytes(folder_ / "f.tiles.json"));
  EXPECT_THAT(tiled.errors, HasSubstr("f.tiles.json: "));
  EXPECT_THAT(tiled.errors, HasSubstr(" points in " + std::to_string(list["tiles"].size()) + " tiles from "));
  EXPECT_THAT(tiled.errors, testing::Not(HasSubstr("f.ply:"))) << "there is no such file";
}

// One file and tiles of the same name are one cloud each: the earlier one would be taken for a part of the later.
TEST_F(CloudFormats, TilesTakeThePlaceOfOneFileAndOneFileThatOfTiles) {
  const auto names = [&] {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_ / "out")) found.push_back(entry.path().filename());
    return found;
  };
  fs::create_directory(folder_ / "out");
  for (const std::string suffix : {".ply", ".las"}) {
    const fs::path cloud = folder_ / "out" / ("c" + suffix);
    const std::vector<std::string> tiled{"--tile_size", "1000"};
    ASSERT_EQ(Fuse(cloud).exit_code, 0);
    ASSERT_EQ(Fuse(cloud, tiled).exit_code, 0);
    EXPECT_THAT(names(), testing::Not(testing::Contains("c" + suffix)));
    EXPECT_THAT(names(), testing::Not(testing::Contains("c" + suffix + ".vis")));
    EXPECT_THAT(names(), testing::IsSupersetOf({std::string("c.tiles.json"), "c_500_5300" + suffix}));
    ASSERT_EQ(Fuse(cloud).exit_code, 0);
    std::vector<std::string> whole{"c" + suffix, "c" + suffix + ".json"};
    if (suffix == ".ply") whole.push_back("c.ply.vis");
    EXPECT_THAT(names(), testing::UnorderedElementsAreArray(whole));
    for (const std::string& name : whole) fs::remove(folder_ / "out" / name);
  }
}

TEST_F(CloudFormats, TilesLeaveFilesOfOthersAndOfOtherFormats) {
  const std::string scan = "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", las = "LASF of somebody";
  const std::vector<std::string> tiled{"--tile_size", "1000"};
  test_support::WriteBytes(folder_ / "a.ply", scan);
  test_support::WriteBytes(folder_ / "b.las", las);
  ASSERT_EQ(Fuse(folder_ / "a.ply", tiled).exit_code, 0);
  ASSERT_EQ(Fuse(folder_ / "b.las", tiled).exit_code, 0);
  EXPECT_EQ(ReadBytes(folder_ / "a.ply"), scan);
  EXPECT_EQ(ReadBytes(folder_ / "b.las"), las);
  // The list names tiles in LAS.
  ASSERT_EQ(Fuse(folder_ / "b.ply").exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "b_500_5300.las"));
  EXPECT_TRUE(fs::exists(folder_ / "b.tiles.json"));
}

// One list names the tiles of a name: that of the later format would know the earlier ones no more.
TEST_F(CloudFormats, TilesOfAnotherFormatKeepTheirList) {
  const std::vector<std::string> tiled{"--tile_size", "1000"};
  ASSERT_EQ(Fuse(folder_ / "c.las", tiled).exit_code, 0);
  const std::string list = ReadBytes(folder_ / "c.tiles.json");
  const auto refused = Fuse(folder_ / "c.ply", tiled);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.errors,
              testing::MatchesRegex("(.|\n)*c.tiles.json lists c_[0-9_]+.las and other tiles of another suffix than '.ply'(.|\n)*"));
  EXPECT_EQ(ReadBytes(folder_ / "c.tiles.json"), list);
  EXPECT_FALSE(fs::exists(folder_ / "c_500_5300.ply"));
  const auto index = nlohmann::json::parse(list);
  for (const auto& tile : index["tiles"]) fs::remove(folder_ / tile["file"].get<std::string>());
  EXPECT_EQ(Fuse(folder_ / "c.ply", tiled).exit_code, 0);
}

// Points of the plane, and of another program's reading of the file.
TEST_F(CloudFormats, LaspyReadsThem) {
  std::ofstream(folder_ / "crs.wkt") << kCrs << "\n";
  ASSERT_EQ(Fuse(folder_ / "c.las", {"--crs", folder_ / "crs.wkt"}).exit_code, 0);
  ASSERT_EQ(Fuse(folder_ / "c.ply").exit_code, 0);
  const auto read = RunProgram(
      {"python3", "-c",
       "import sys, laspy\n"
       "c = laspy.read(sys.argv[1])\n"
       "print('points', len(c), c.header.version, c.point_format.id, c.header.parse_crs is not None)\n"
       "print('wkt', [v.string for v in c.vlrs if v.record_id == 2112][0])\n"
       "print('views', int(c.views.min()), int(c.views.max()), int(c.inferred.max()), int(c.red.max()) % 257)\n"
       "print('scale', c.header.scales.max())\n"
       "print('data', *[v for a in (c.x, c.y, c.z) for v in (a.min(), a.max())])\n"
       "print('header', *[v for pair in zip(c.header.mins, c.header.maxs) for v in pair])\n",
       folder_ / "c.las"});
  if (read.exit_code != 0 && read.errors.find("laspy") != std::string::npos) GTEST_SKIP() << "laspy is not installed";
  ASSERT_EQ(read.exit_code, 0) << read.errors;
  std::size_t num_points = 0;
  constexpr double kOffset[3] = {500000, 5300000, 400};
  std::array<double, 6> extents{1e300, -1e300, 1e300, -1e300, 1e300, -1e300};  // least x, largest x; y; z
  const std::string ply = ReadBytes(folder_ / "c.ply").substr(0, 200);
  ASSERT_THAT(ply, HasSubstr("comment offset 500000 5300000 400"));
  PlyRows(folder_ / "c.ply").ForEachRow("vertex", {"x", "y", "z"}, [&](const double* row) {
    ++num_points;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      extents[2 * axis] = std::min(extents[2 * axis], row[axis] + kOffset[axis]);
      extents[2 * axis + 1] = std::max(extents[2 * axis + 1], row[axis] + kOffset[axis]);
    }
  });
  EXPECT_THAT(read.output, HasSubstr("points " + std::to_string(num_points) + " 1.4 7"));
  EXPECT_THAT(read.output, HasSubstr(std::string("wkt ") + kCrs));
  std::istringstream values(read.output.substr(read.output.find("scale ")));
  std::string word;
  double scale = 0;
  ASSERT_TRUE(values >> word >> scale) << read.output;
  EXPECT_LE(scale, 0.001);
  for (const char* source : {"data", "header"}) {
    ASSERT_TRUE(values >> word);
    EXPECT_EQ(word, source);
    for (const double expected : extents) {
      double value = 0;
      ASSERT_TRUE(values >> value) << read.output;
      EXPECT_NEAR(value, expected, scale) << source;
    }
  }
}

}  // namespace
}  // namespace colmap_ext
