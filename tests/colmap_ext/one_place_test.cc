#include "colmap_ext/one_place.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "tests/support/log_capture.h"
#include "tests/support/placed_cameras.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Images "0.png", "1.png", ... look along z; their centres are at x and, beside it, at `y`. The first two see 100 points, all but
// one of them 10 units away.
SparseModel ModelAt(const std::vector<double>& centers, bool has_points = true, double y = 0) {
  std::vector<test_support::PlacedCamera> cameras;
  for (const double x : centers) cameras.push_back({.x = x, .y = y});
  SparseModel model = test_support::ModelOf(cameras);
  for (int i = 0; has_points && i < 100; ++i) {
    SparsePoint point;
    point.point3D_id = static_cast<std::uint64_t>(i + 1);
    point.xyz = {centers[0], y, i == 0 ? 0.01 : 10.0};
    for (std::size_t k = 0; k < 2; ++k) {
      point.track.push_back({static_cast<std::uint32_t>(k + 1), static_cast<std::uint32_t>(i)});
      model.images[k].observations.push_back({32, 24, point.point3D_id});
    }
    model.points.push_back(point);
  }
  return model;
}

class OnePlaceTest : public ::testing::Test {
 protected:
  Workspace Open(const SparseModel& model) {
    WriteSparseModelBinary(model, folder_ / "sparse");
    return Workspace({.path = folder_.path()});
  }

  const TemporaryFolder folder_;
};

// A tenth of a degree at 10 units is 0.01745 of them, to the right as to the left; a single near point is a mismatch.
TEST_F(OnePlaceTest, IsWhereNearSurfacesDoNotMove) {
  const Workspace workspace = Open(ModelAt({0, 0.017, 0.018, -0.017, 5}));
  const OnePlace one_place(workspace);
  EXPECT_TRUE(one_place.StandTogether(0, 1));
  EXPECT_FALSE(one_place.StandTogether(0, 2));
  EXPECT_TRUE(one_place.StandTogether(0, 3));
  EXPECT_FALSE(one_place.StandTogether(0, 4));
}

// The third image sees no point; poses of a text file are rounded. Far from the origin nothing changes.
TEST_F(OnePlaceTest, WithoutPointsIsWhereOnlyRoundingTellsCentresApart) {
  for (const double y : {0.0, 5e6}) {
    const Workspace workspace = Open(ModelAt({0, 5, 2, 2.000004, 2.00001}, true, y));
    const OnePlace one_place(workspace);
    EXPECT_TRUE(one_place.StandTogether(2, 3));
    EXPECT_FALSE(one_place.StandTogether(2, 4));
  }
}

// At 1e7 it would make 10 units a rounding.
TEST_F(OnePlaceTest, ACameraThatWasThrownFarOutTellsNothing) {
  const Workspace workspace = Open(ModelAt({0, 5, 2, 2.000004, 1e7}));
  const OnePlace one_place(workspace);
  EXPECT_FALSE(one_place.StandTogether(0, 1));
  EXPECT_TRUE(one_place.StandTogether(2, 3));
}

TEST_F(OnePlaceTest, NamedSourcesThereAreLeftOutWithAWarning) {
  const Workspace workspace = Open(ModelAt({0, 0, 0.5, 1}));
  const phi::SparseScene scene = MakeSparseScene(workspace.model());
  test_support::WriteBytes(folder_ / "stereo/patch-match.cfg",
                           "0.png\n1.png, 3.png, 2.png\n2.png\n__all__\n1.png\n__all__\n");
  const auto sources_of = [&](phi::Formulas formulas) {
    std::vector<std::vector<int>> sources;
    for (const ImageJob& job : ListImageJobs(workspace, scene, "", {.method = formulas}))
      sources.push_back(job.sources);
    return sources;
  };
  const test_support::LogCapture log;
  EXPECT_THAT(sources_of(phi::Formulas::kPaper),
              ElementsAre(ElementsAre(1, 3, 2), ElementsAre(0, 1, 3), ElementsAre(0, 2, 3)));
  EXPECT_TRUE(log.messages().empty());
  EXPECT_THAT(sources_of(phi::Formulas::kRobust),
              ElementsAre(ElementsAre(3, 2), ElementsAre(0, 1, 3), ElementsAre(2, 3)));
  EXPECT_THAT(log.messages(), ElementsAre(HasSubstr("2 source images that are named stand where their "
                                                    "reference image does, '1.png' of '0.png' the first")));
}

}  // namespace
}  // namespace colmap_ext
