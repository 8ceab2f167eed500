// Graphs by hand: which images fusion compares.
#include "colmap_ext/fusion/neighbor_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "colmap_ext/sparse_model.h"
#include "colmap_ext/workspace.h"
#include "tests/support/placed_cameras.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::ModelOf;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

// `count` points that both images see.
void Share(std::size_t a, std::size_t b, int count, SparseModel* model) {
  for (int i = 0; i < count; ++i) {
    SparsePoint point;
    point.point3D_id = model->points.size() + 1;
    point.xyz = {0, 0, 4};
    for (const std::size_t k : {a, b}) {
      SparseImage& image = model->images[k];
      point.track.push_back({image.image_id, static_cast<std::uint32_t>(image.observations.size())});
      image.observations.push_back({32, 24, point.point3D_id});
    }
    model->points.push_back(point);
  }
}

NeighborGraph GraphOf(const SparseModel& model, int max_neighbors) {
  std::vector<int> images;
  for (int k = 0; k < static_cast<int>(model.images.size()); ++k) images.push_back(k);
  const Workspace workspace(model, {}, -1);
  return BuildNeighborGraph(workspace, images, OnePlace(workspace), max_neighbors);
}

// Without points the nearest cameras are neighbours; 89 degrees are less than a right angle, 91 more.
TEST(NeighborGraph, CamerasThatLookAwayAreNoNeighbours) {
  const SparseModel model = ModelOf({{0, 0}, {1, 89}, {0.5, 91 + 89}, {0.1, 91}});
  EXPECT_THAT(GraphOf(model, 8), ElementsAre(ElementsAre(1), UnorderedElementsAre(0, 3), ElementsAre(3), UnorderedElementsAre(1, 2)));
  EXPECT_THAT(GraphOf(model, -1)[0], ElementsAre(1, 2, 3)) << "all were asked for";
}

// patch-match.cfg counts as one more point, and may name what is not fused. Positions are those in the list of images.
TEST(NeighborGraph, ConfiguredPairsAreNeighbours) {
  const TemporaryFolder folder;
  SparseModel model = ModelOf({{0, 0}, {1, 0}, {2, 0}, {3, 180}});
  const auto graph = [&] {
    WriteSparseModelBinary(model, folder / "sparse");
    const Workspace workspace({.path = folder.path()});
    return BuildNeighborGraph(workspace, {1, 2, 3}, OnePlace(workspace), 1);
  };
  EXPECT_THAT(graph(), ElementsAre(ElementsAre(1), ElementsAre(0), ElementsAre()));
  WriteBytes(folder / "stereo/patch-match.cfg", "1.png\n0.png, 3.png\n0.png\n2.png\n");
  EXPECT_THAT(graph(), ElementsAre(ElementsAre(2, 1), ElementsAre(0), ElementsAre(0)));
  Share(1, 2, 2, &model);
  EXPECT_THAT(graph()[0], ElementsAre(1, 2)) << "two points are more than the pair";
  Share(1, 3, 2, &model);
  EXPECT_THAT(graph()[0], ElementsAre(2, 1)) << "the pair comes on top of its points";
}

// Three shots of one tripod, and two of the same wall from elsewhere, which share fewer points.
TEST(NeighborGraph, ImagesAtOnePlaceLeaveRoomForOthers) {
  SparseModel model = ModelOf({{0, 0}, {0, 0}, {0, 0}, {1, 0}, {2, 0}});
  for (const auto& [a, b] : {std::pair{0, 1}, {0, 2}, {1, 2}}) Share(static_cast<std::size_t>(a), static_cast<std::size_t>(b), 20, &model);
  for (const std::size_t k : {0u, 1u, 2u}) Share(k, 3, 4, &model), Share(k, 4, 3, &model);
  EXPECT_THAT(GraphOf(model, 2)[0], ElementsAre(1, 3, 4));
  EXPECT_THAT(GraphOf(model, 2)[2], ElementsAre(3, 4));
  EXPECT_THAT(GraphOf(model, -1)[0], ElementsAre(1, 2, 3, 4));
  // Without points, the nearest ones elsewhere come first.
  for (SparseImage& image : model.images) image.observations.clear();
  model.points.clear();
  EXPECT_THAT(GraphOf(model, 2)[0], ElementsAre(3, 4));
}

// Six images share points with the first alone, fewer and fewer. It takes twice what each may want; the last two stand right beside
// it, and go without. The four look the other way, so that they find one another.
TEST(NeighborGraph, APopularImageHasAtMostTwiceTheNeighbours) {
  SparseModel star = ModelOf({{0, 0}, {10, 180}, {20, 180}, {31, 180}, {43, 180}, {0.1, 0}, {0.2, 0}});
  for (int k = 1; k <= 6; ++k) Share(0, static_cast<std::size_t>(k), 7 - k, &star);
  EXPECT_THAT(GraphOf(star, 2), ElementsAre(ElementsAre(1, 2, 3, 4), ElementsAre(0, 2), ElementsAre(0, 1, 3), ElementsAre(0, 2, 4),
                                            ElementsAre(0, 3), ElementsAre(6), ElementsAre(5)));
  // Neither side of the last pair wants another neighbour.
  SparseModel row = ModelOf({{0, 0}, {1, 0}, {2, 0}, {3, 0}});
  Share(0, 1, 4, &row);
  Share(2, 3, 3, &row);
  Share(0, 2, 2, &row);
  EXPECT_THAT(GraphOf(row, 1), ElementsAre(ElementsAre(1), ElementsAre(0), ElementsAre(3), ElementsAre(2)));
}

}  // namespace
}  // namespace colmap_ext
