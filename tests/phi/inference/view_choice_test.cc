#include "phi/inference/view_choice.h"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "phi/base/error.h"
#include "phi/inference/hypotheses.h"
#include "phi/inference/region_planes.h"
#include "tests/support/centered_view.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120;

// A plain image and its source, which is the same view once more. The image measured frames a hundredth before a wall at 21 places, and
// the wall at 20; the source measured neither.
struct FramesOnAWall {
  ImagePlane wall{0.3, 0, 0}, frames{0.303, 0, 0};
  SceneView view = test_support::CenteredView(1, kWidth, kHeight, 150);
  std::shared_ptr<const GrayImage> image = std::make_shared<const GrayImage>(kWidth, kHeight, std::uint8_t{120});
  std::shared_ptr<const ImageRegions> regions = SharedRegions(*image);
  MeasurementMap measured = AllMeasured(PlaneMap(kWidth, kHeight));
  Rules rules;

  FramesOnAWall() {
    rules.Set(Rule::kSky, 0);  // nothing tells this plain wall from it
    for (int i = 0; i < 41; ++i) {
      const double w = i % 2 == 0 ? frames.a : wall.a;
      for (int k = 0; k < 16; ++k) {
        const int x = 22 * (i % 7) + 7 + k % 4, y = 16 * (i / 7) + 8 + k / 4;
        measured.planes(x, y) = {{0, 0, -1}, static_cast<float>(1 / w)};
        measured.states(x, y) = PixelState::kMeasured;
      }
    }
  }

  std::shared_ptr<const ViewRegions> Told() const {
    const SpotGrid grid(kWidth, kHeight);
    ViewRegions told;
    told.label = Array2D<std::int32_t>(grid.columns, grid.rows, 0);
    told.regions.resize(1);
    told.regions[0].image_region = regions->region(kWidth / 2, kHeight / 2);
    told.regions[0].box.AddCell(0, 0, grid.step);
    told.regions[0].box.AddCell(grid.columns - 1, grid.rows - 1, grid.step);
    return std::make_shared<const ViewRegions>(std::move(told));
  }

  InferenceInput Input() const {
    InferenceInput input;
    input.reference = {&view, image};
    input.measured = std::make_shared<const MeasurementMap>(measured);
    input.regions = regions;
    input.sources = {{&view, image}};
    input.source_depths = {std::make_shared<const MeasuredDepths>(AllMeasured(DepthMap(kWidth, kHeight)))};
    input.source_regions = {Told()};
    return input;
  }

  // What a region with that plane alone chose.
  std::shared_ptr<const ViewChoice> Choosing(const ImagePlane& plane, const ViewChoice& like) const {
    ViewChoice choice = like;
    for (FittedRegion& region : choice.fitted.regions) region.planes = {RegionPlane{plane, 0, 0, 1e-9, 0, 1e-9}};
    return std::make_shared<const ViewChoice>(std::move(choice));
  }

  double InverseDepthAgain(const InferenceInput& input) const {
    const Array2D<float> anchors = AnchorMap(*input.measured, Formulas::kRobust);
    return FindRegionPlanes(input, regions, anchors.view(), rules).At(kWidth / 2, kHeight / 2)[0].InverseDepth(kWidth / 2, kHeight / 2);
  }
};

TEST(ViewChoice, IsWhatInferenceTakesWithoutIt) {
  const FramesOnAWall scene;
  const InferenceInput input = scene.Input();
  const ViewChoice choice = ChooseRegionPlanes(input, scene.rules);
  const std::int32_t region = scene.regions->region(kWidth / 2, kHeight / 2);
  ASSERT_TRUE(choice.PlanesOf(region)[0].IsThere());
  EXPECT_EQ(choice.PlanesOf(region)[0].InverseDepth(kWidth / 2, kHeight / 2), scene.InverseDepthAgain(input));
  EXPECT_NEAR(scene.InverseDepthAgain(input), scene.frames.a, 1e-4);
  EXPECT_GT(choice.bytes(), choice.fitted.regions[0].cells.size() * sizeof(AnchorCell));
}

TEST(ViewChoice, ARegionTakesThePlaneThatTheSourcesRegionTook) {
  const FramesOnAWall scene;
  InferenceInput input = scene.Input();
  const ViewChoice first = ChooseRegionPlanes(input, scene.rules);
  input.choice = std::make_shared<const ViewChoice>(first);
  EXPECT_NEAR(scene.InverseDepthAgain(input), scene.frames.a, 1e-4) << "what the source chose is not known";
  input.source_choices = {scene.Choosing(scene.wall, first)};
  EXPECT_NEAR(scene.InverseDepthAgain(input), scene.wall.a, 1e-4);
}

TEST(ViewChoice, NeitherTheSkyNorWhatItsShadeTellsChoosesAgain) {
  const FramesOnAWall scene;
  InferenceInput input = scene.Input();
  const ViewChoice first = ChooseRegionPlanes(input, scene.rules);
  input.source_choices = {scene.Choosing(scene.wall, first)};
  const auto again = [&](const auto& change) {
    ViewChoice choice = first;
    for (FittedRegion& region : choice.fitted.regions) change(&region);
    input.choice = std::make_shared<const ViewChoice>(choice);
    return scene.InverseDepthAgain(input);
  };
  EXPECT_NEAR(again([](FittedRegion* region) { region->is_settled = true; }), scene.frames.a, 1e-4);
  for (const Sky sky : {Sky::kMayBe, Sky::kSeen}) {
    EXPECT_EQ(again([&](FittedRegion* region) { region->planes = {}, region->sky = sky; }), 0);
  }
}

TEST(ViewChoice, MustBeOfTheImagesRegions) {
  const FramesOnAWall scene;
  InferenceInput input = scene.Input();
  ViewChoice choice = ChooseRegionPlanes(input, scene.rules);
  choice.fitted.index.push_back(-1);
  input.choice = std::make_shared<const ViewChoice>(choice);
  EXPECT_THROW(scene.InverseDepthAgain(input), UsageError);
  choice.fitted.index.pop_back();
  choice.exposures.clear();  // the source could not be read then
  input.choice = std::make_shared<const ViewChoice>(choice);
  EXPECT_THROW(scene.InverseDepthAgain(input), InputError);
}

}  // namespace
}  // namespace phi
