// Parts of a scene: what they are, and that several processes make one process's cloud of them.
#include "colmap_ext/fusion/fusion_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "colmap_ext/fusion/fusion_shards.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/sparse_model.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/log_capture.h"
#include "tests/support/map_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::LogCapture;
using test_support::ReadBytes;
using test_support::RenderedScene;
using test_support::SphereScene;
using test_support::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Images on a square grid, neighbours of all at most `reach` columns and rows away.
NeighborGraph Grid(int side, int reach) {
  NeighborGraph graph(static_cast<std::size_t>(side * side));
  for (int a = 0; a < side * side; ++a) {
    for (int b = 0; b < side * side; ++b) {
      const int columns = std::abs(a % side - b % side), rows = std::abs(a / side - b / side);
      if (a != b && std::max(columns, rows) <= reach) graph[static_cast<std::size_t>(a)].push_back(b);
    }
  }
  return graph;
}

NeighborGraph Row(int count) {
  NeighborGraph graph(static_cast<std::size_t>(count));
  for (int p = 0; p + 1 < count; ++p) {
    graph[static_cast<std::size_t>(p)].push_back(p + 1);
    graph[static_cast<std::size_t>(p) + 1].push_back(p);
  }
  return graph;
}

// All images that must be there for a part: the earlier parts that it knows, and theirs.
std::set<int> Ancestors(const std::vector<std::vector<int>>& earlier, int part) {
  std::set<int> all;
  for (const int k : earlier[static_cast<std::size_t>(part)]) {
    all.insert(k);
    all.merge(Ancestors(earlier, k));
  }
  return all;
}

TEST(FusionParts, AFewImagesAreOnePartFromEndToEnd) {
  EXPECT_THAT(DissectImages(Row(6), 6), ElementsAre(ElementsAre(0, 1, 2, 3, 4, 5)));
}

// Seven in a row: the one in the middle first, then either side, whose ends that touch it come first.
TEST(FusionParts, TheMiddleOfARowSeparatesItsHalves) {
  const std::vector<FusionPart> parts = DissectImages(Row(7), 3);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_THAT(parts[0], ElementsAre(3));
  const auto earlier = FindEarlierParts(Row(7), parts);
  EXPECT_THAT(earlier, ElementsAre(ElementsAre(), ElementsAre(0), ElementsAre(0)));
  std::set<FusionPart> sides(parts.begin() + 1, parts.end());
  EXPECT_EQ(sides, (std::set<FusionPart>{{2, 1, 0}, {4, 5, 6}}));
}

TEST(FusionParts, OfAGridMostNeedNothingOfOneAnother) {
  const NeighborGraph graph = Grid(30, 2);
  const std::vector<FusionPart> parts = DissectImages(graph, 100);
  const auto earlier = FindEarlierParts(graph, parts);
  std::vector<int> order = OrderOf(parts);
  int num_in_leaves = 0;
  for (int k = 0; k < static_cast<int>(parts.size()); ++k) {
    EXPECT_LE(parts[static_cast<std::size_t>(k)].size(), 100u);
    const bool is_leaf = std::none_of(earlier.begin(), earlier.end(), [&](const std::vector<int>& needed) {
      return std::find(needed.begin(), needed.end(), k) != needed.end();
    });
    if (is_leaf) num_in_leaves += static_cast<int>(parts[static_cast<std::size_t>(k)].size());
    EXPECT_LT(Ancestors(earlier, k).size(), parts.size() / 2)
        << "part " << k << " waits for half of the scene";
  }
  EXPECT_GT(num_in_leaves, 500) << "of 900";
  std::sort(order.begin(), order.end());
  for (int p = 0; p < 900; ++p) ASSERT_EQ(order[static_cast<std::size_t>(p)], p);
}

TEST(FusionParts, ImagesThatAllNeighbourAllStayTogether) {
  EXPECT_EQ(DissectImages(Grid(5, 5), 10).size(), 1u);
}

TEST(FusionParts, ImagesWithoutNeighboursFillParts) {
  const std::vector<FusionPart> parts = DissectImages(NeighborGraph(25), 10);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].size() + parts[1].size() + parts[2].size(), 25u);
}

class FusionShards : public ::testing::Test {
 protected:
  void SetUp() override {
    test_support::WriteMapWorkspace(
        SphereScene({.width = 80, .height = 60, .focal = 75, .num_views = 9}), folder_.path());
    options_.max_neighbors = 2;
    options_.max_part_images = 2;
    options_.scratch_folder = folder_.path();
  }

  // Cloud and views.
  std::string Fuse(const fs::path& name, bool join) {
    const Workspace workspace({.path = folder_.path()});
    const auto writer = MakePlyCloudWriter({.path = folder_ / name});
    report_ = join ? JoinParts(workspace, options_, parts_, writer.get())
                   : FuseScene(workspace, options_, writer.get());
    writer->Commit();
    return ReadBytes(folder_ / name) + ReadBytes((folder_ / name).string() + ".vis");
  }
  ShardFusionReport FuseShard(int index, int count) {
    return colmap_ext::FuseShard(Workspace({.path = folder_.path()}), options_, parts_,
                                 {.index = index, .count = count, .only_stage = {}});
  }

  fs::path MapPath(const fs::path& maps, int view, const std::string& kind = "geometric") const {
    return folder_ / "stereo" / maps / (test_support::MapWorkspaceImageName(view) + "." + kind + ".bin");
  }

  TemporaryFolder folder_;
  const fs::path parts_ = folder_ / "cloud.ply.parts";
  SceneFusionOptions options_;
  SceneFusionReport report_;
};

TEST_F(FusionShards, InAnyOrderEndInTheCloudOfOneProcess) {
  const std::string whole = Fuse("whole.ply", false);
  const SceneFusionReport expected = report_;
  for (const int count : {1, 2, 3, 5}) {
    int num_waiting = 1, num_made = 0, rounds = 0;
    for (; num_waiting > 0 && rounds < 20; ++rounds) {
      num_waiting = 0;
      for (int k = count - 1; k >= 0; --k) {
        const ShardFusionReport report = FuseShard(k, count);
        num_waiting += report.num_waiting;
        num_made += report.num_made;
      }
    }
    EXPECT_LT(rounds, 20);
    EXPECT_GT(num_made, 3) << "the scene is one part: nothing is tested";
    EXPECT_TRUE(count < 5 || rounds > 1) << "nobody waited: nothing is tested";
    EXPECT_EQ(Fuse("joined.ply", true), whole) << count << " shards";
    EXPECT_EQ(report_.num_points, expected.num_points);
    EXPECT_EQ(report_.outcomes[phi::PixelOutcome::kCovered], expected.outcomes[phi::PixelOutcome::kCovered]);
    RemoveParts(parts_);
    EXPECT_FALSE(fs::exists(parts_));
  }
}

TEST_F(FusionShards, PartsOfOtherOptionsOrMapsAreMadeAgain) {
  FuseShard(0, 2);
  options_.rule.max_depth_error = 0.005;
  EXPECT_EQ(Fuse("joined.ply", true), Fuse("whole.ply", false));
  RemoveParts(parts_);
  FuseShard(0, 1);
  const std::string before = Fuse("whole.ply", false);
  WriteDepthMap(MapPath("depth_maps", 0), phi::Array2D<float>(80, 60, 3.5f));
  const std::string after = Fuse("whole.ply", false);
  EXPECT_TRUE(after != before) << "the map does not matter: nothing is tested";
  EXPECT_TRUE(Fuse("joined.ply", true) == after);
}

// The first two of eleven images look away from the others, so that no part but theirs reads anything of them; but all
// others' positions change with the first one's maps.
TEST_F(FusionShards, PartsAreMadeAgainWhereAnImageFarAwayGainsOrLosesItsMaps) {
  RenderedScene scene = SphereScene({.width = 80, .height = 60, .focal = 75, .num_views = 2});
  RenderedScene others = SphereScene({.width = 80, .height = 60, .focal = 75, .num_views = 9});
  Similarity turn;
  turn.rotation = Eigen::Vector3d(-1, 1, -1).asDiagonal();
  turn.translation = {0, 0, -50};
  Transform(turn, &others);
  for (std::size_t k = 0; k < others.views.size(); ++k) {
    scene.views.push_back(others.views[k]);
    scene.truth.push_back(others.truth[k]);
  }
  test_support::WriteMapWorkspace(scene, folder_.path());
  const fs::path map = MapPath("depth_maps", 0), hidden = folder_ / "hidden.bin";
  FuseShard(0, 1);
  fs::rename(map, hidden);
  EXPECT_TRUE(Fuse("joined.ply", true) == Fuse("whole.ply", false)) << "lost";
  RemoveParts(parts_);
  for (const int shards : {1, 2}) {  // of two shards one sees the map come
    FuseShard(0, shards);
    fs::rename(hidden, map);
    if (shards == 2) FuseShard(1, 2);
    EXPECT_TRUE(Fuse("joined.ply", true) == Fuse("whole.ply", false)) << "gained, " << shards << " shards";
    EXPECT_EQ(report_.num_images, 11);
    fs::rename(map, hidden);
    RemoveParts(parts_);
  }
}

// Views are written as numbers of the model's images.
TEST_F(FusionShards, PartsAreMadeAgainWhereTheModelLosesAnImageWithoutMaps) {
  fs::remove(MapPath("depth_maps", 0));
  FuseShard(0, 1);
  const std::string before = Fuse("whole.ply", false);
  SparseModel model = ReadSparseModel(folder_ / "sparse");
  const std::uint32_t gone = model.images.front().image_id;
  model.images.erase(model.images.begin());
  for (SparsePoint& point : model.points)
    std::erase_if(point.track, [gone](const TrackElement& element) { return element.image_id == gone; });
  WriteSparseModelBinary(model, folder_ / "sparse");
  fs::remove(folder_ / "stereo/fusion.cfg");
  const std::string after = Fuse("whole.ply", false);
  EXPECT_TRUE(after != before);
  EXPECT_TRUE(Fuse("joined.ply", true) == after);
}

TEST_F(FusionShards, PartsOfMeasuredMapsAreMadeAgainWhereTheirCluesChange) {
  for (const char* maps : {"depth_maps", "normal_maps"}) {
    for (int view = 0; view < 9; ++view) fs::rename(MapPath(maps, view), MapPath(maps, view, "measured"));
  }
  options_.input.kind = kMeasured;
  const Workspace workspace({.path = folder_.path()});
  for (int view = 0; view < 9; ++view) WriteMask(workspace.FilledMaskPath(view, kMeasured), phi::Mask(80, 60, 0));
  FuseShard(0, 1);
  const std::string before = Fuse("whole.ply", false);
  phi::Mask mask(80, 60, 0);
  for (int x = 0; x < 80; ++x) {
    for (int y = 0; y < 30; ++y) mask(x, y) = 128;  // a clue, which fusion leaves out
  }
  WriteMask(workspace.FilledMaskPath(0, kMeasured), mask);
  const std::string after = Fuse("whole.ply", false);
  EXPECT_TRUE(after != before);
  EXPECT_TRUE(Fuse("joined.ply", true) == after);
}

// 80 x 60 pixels are 57.6 kB a map, and 28.8 kB more while one is read: an image and two neighbours fit, and some have more.
TEST_F(FusionShards, TheWarningOfLittleMemoryComesOnceAndIsOfAllParts) {
  options_.num_threads = 1;
  options_.max_memory_gb = 0.00021;
  const LogCapture of_whole;
  Fuse("whole.ply", false);
  ASSERT_THAT(of_whole.messages(), ElementsAre(HasSubstr("images are compared with fewer neighbours")));
  const LogCapture of_parts;
  EXPECT_GT(FuseShard(0, 1).num_made, 3);
  EXPECT_EQ(of_parts.messages(), of_whole.messages());
  const LogCapture of_finished;
  Fuse("joined.ply", true);
  EXPECT_THAT(of_finished.messages(), IsEmpty());
}

// A part that breaks off is no part.
TEST_F(FusionShards, DamagedPartsAreMadeAgain) {
  FuseShard(0, 1);
  int num_damaged = 0;
  for (const auto& entry : fs::directory_iterator(parts_)) {
    if (num_damaged++ % 2 == 0) fs::resize_file(entry.path(), fs::file_size(entry.path()) / 2);
  }
  EXPECT_GT(num_damaged, 3);
  EXPECT_EQ(Fuse("joined.ply", true), Fuse("whole.ply", false));
}

}  // namespace
}  // namespace colmap_ext
