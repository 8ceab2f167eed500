#include "phi/measurement.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

constexpr PixelState kStates[] = {PixelState::kNone, PixelState::kMeasured, PixelState::kClue, PixelState::kInferredAlone,
                                  PixelState::kInferredConfirmed};
constexpr int kNumStates = 5;

// One pixel of each state; depths 1 to 4 where there are any.
MeasurementMap OneOfEach() {
  MeasurementMap map{PlaneMap(kNumStates, 1), StateMap(kNumStates, 1)};
  for (int i = 0; i < kNumStates; ++i) {
    map.states(i, 0) = kStates[i];
    if (i > 0) map.planes(i, 0) = {{0, 0, -1}, static_cast<float>(i)};
  }
  return map;
}

TEST(Measurement, AStateSaysWhatAPixelMayBeUsedFor) {
  struct Uses {
    bool measured, inferred, published, carries_planes;
  };
  constexpr Uses kExpected[] = {{false, false, false, false},
                                {true, false, true, true},
                                {false, false, false, true},
                                {false, true, true, false},
                                {false, true, true, false}};
  for (int i = 0; i < kNumStates; ++i) {
    EXPECT_EQ(IsMeasured(kStates[i]), kExpected[i].measured) << i;
    EXPECT_EQ(IsInferred(kStates[i]), kExpected[i].inferred) << i;
    EXPECT_EQ(IsPublished(kStates[i]), kExpected[i].published) << i;
    EXPECT_EQ(CarriesPlanes(kStates[i]), kExpected[i].carries_planes) << i;
  }
}

TEST(Measurement, CluesAreNotPublished) {
  const MeasurementMap map = OneOfEach();
  const PlaneMap published = PublishedPlanes(map);
  for (int i = 0; i < kNumStates; ++i) {
    EXPECT_EQ(published(i, 0).depth, i == 2 ? 0 : i);
    EXPECT_EQ(published(i, 0).normal.z, i == 2 || i == 0 ? 0 : -1);
  }
  EXPECT_EQ(CountPublished(map), 3);
  EXPECT_EQ(CountPublished({map.planes, {}}), 4) << "an estimate: all that has depth";
}

TEST(Measurement, OnlyMeasuredDepthsAreEvidence) {
  const MeasuredDepths depths = DepthsOf(OneOfEach());
  EXPECT_FALSE(MeasuredDepthsView().IsKnown());
  ASSERT_TRUE(depths.view().IsKnown());
  for (int i = 0; i < kNumStates; ++i) EXPECT_EQ(depths.view().Evidence(i, 0), i == 1 ? 1 : 0) << i;
}

TEST(Measurement, MapsOfOtherProgramsAreMeasuredWhereTheyHaveDepth) {
  PlaneMap planes(3, 1, {{0, 0, -1}, 2});
  planes(1, 0).depth = 0;
  planes(2, 0).depth = -2;
  const MeasurementMap map = AllMeasured(planes);
  const MeasuredDepths depths = AllMeasured(DepthsOf(planes));
  for (int x = 0; x < 3; ++x) {
    EXPECT_EQ(map.states(x, 0), x == 0 ? PixelState::kMeasured : PixelState::kNone);
    EXPECT_EQ(depths.states(x, 0), map.states(x, 0));
  }
}

TEST(Measurement, MasksTakePixelsAway) {
  Array2D<std::uint8_t> mask(kNumStates, 1, 255);
  mask(1, 0) = mask(4, 0) = 0;
  MeasurementMap map = OneOfEach();
  MeasuredDepths depths = DepthsOf(map);
  DropMasked(mask, &map);
  DropMasked(mask, &depths);
  for (int i = 0; i < kNumStates; ++i) {
    const bool is_masked = i == 1 || i == 4;
    EXPECT_EQ(map.states(i, 0), is_masked ? PixelState::kNone : kStates[i]);
    EXPECT_EQ(map.planes(i, 0).depth, is_masked ? 0 : i);
    EXPECT_EQ(depths.states(i, 0), map.states(i, 0));
    EXPECT_EQ(depths.depths(i, 0), map.planes(i, 0).depth);
  }
}

}  // namespace
}  // namespace phi
