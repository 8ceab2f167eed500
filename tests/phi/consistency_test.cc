#include "phi/filtering/consistency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "phi/base/random.h"
#include "phi/cpu/cpu_filter.h"
#include "phi/filtering/filter_setup.h"
#include "phi/geometry/camera.h"

namespace phi {
namespace {

// Two cameras side by side (baseline 0.5) that look at a fronto-parallel plane at depth 2; f = 100, so one
// pixel of disparity is 0.08 of depth there.
class ConsistencyTest : public ::testing::Test {
 protected:
  ConsistencyTest() {
    reference_.pinhole = {80, 60, 100, 100, 40, 30};
    source_ = reference_;
    source_.pose.translation = {-0.5, 0, 0};
    view_ = MakeRelativeView(reference_, source_);
    k_ = MakeRayModel(reference_.pinhole);
  }

  bool Consistent(float depth, Vec3f normal = {0, 0, -1}) const {
    return AskAt(60.5f, {normal, depth}) >= Testimony::kConfirms;
  }
  Testimony AskAt(float u, const PlaneHypothesis& h) const {
    return Ask(k_, {u, 30.5f}, h, {view_, map_.view()}, thresholds_);
  }

  Camera reference_, source_;
  RelativeView view_;
  RayModel k_;
  PlaneMap map_{80, 60, PlaneHypothesis{{0, 0, -1}, 2.0f}};
  ConsistencyThresholds thresholds_;
};

TEST_F(ConsistencyTest, AcceptsTheSamePlane) { EXPECT_TRUE(Consistent(2.0f)); }

TEST_F(ConsistencyTest, RelativeDepthErrorOfOnePercentIsTheLimit) {
  thresholds_.max_reprojection_error = 10;
  EXPECT_TRUE(Consistent(2.0f * 1.0098f));
  EXPECT_FALSE(Consistent(2.0f * 1.0103f));
  EXPECT_TRUE(Consistent(2.0f * 0.9905f));
}

TEST_F(ConsistencyTest, ReprojectionErrorInPixelsOfTheReference) {
  thresholds_.max_relative_depth_error = 0.5f;
  // Depth d against 2: the match moves by f * b * |1/d - 1/2| = 50 * |1/d - 0.5| pixels.
  EXPECT_TRUE(Consistent(1 / (0.5f + 0.9f / 50)));
  EXPECT_FALSE(Consistent(1 / (0.5f + 1.1f / 50)));
}

TEST_F(ConsistencyTest, NormalsMayDifferByTheirTolerance) {
  EXPECT_TRUE(Consistent(2.0f, {std::sin(1.03f), 0, -std::cos(1.03f)}));   // 59.0 degrees; the default is 60
  EXPECT_FALSE(Consistent(2.0f, {std::sin(1.07f), 0, -std::cos(1.07f)}));  // 61.3
  FilterOptions options;
  options.max_normal_error = 30;
  thresholds_ = MakeConsistencyThresholds(options);
  EXPECT_TRUE(Consistent(2.0f, {std::sin(0.50f), 0, -std::cos(0.50f)}));   // 28.6 degrees
  EXPECT_FALSE(Consistent(2.0f, {std::sin(0.55f), 0, -std::cos(0.55f)}));  // 31.5 degrees
}

TEST_F(ConsistencyTest, RulesAsTheyAreChangeNoThreshold) {
  const ConsistencyThresholds as_is, made = MakeConsistencyThresholds({});
  EXPECT_EQ(made.same_depth, as_is.same_depth);
  EXPECT_EQ(made.close_depth, as_is.close_depth);
  EXPECT_EQ(made.min_facing_cosine, as_is.min_facing_cosine);
  EXPECT_EQ(made.min_rays_cosine, as_is.min_rays_cosine);
  EXPECT_EQ(made.max_depth_error, 0);
}

// Angles become so many times as wide, up to any; off are the paper's values.
TEST_F(ConsistencyTest, RulesScaleAnglesAndTolerances) {
  FilterOptions options;
  options.method.rules.Set(Rule::kFilterTolerances, 0.5f);
  options.method.rules.Set(Rule::kFewViews, 3);
  const ConsistencyThresholds scaled = MakeConsistencyThresholds(options);
  EXPECT_NEAR(scaled.min_normal_cosine, std::cos(M_PI / 6), 1e-6);
  EXPECT_FLOAT_EQ(scaled.max_relative_depth_error, 0.005f);
  EXPECT_FLOAT_EQ(scaled.min_facing_cosine, -1);
  options.method.rules.Set(Rule::kFilterTolerances, 0);
  EXPECT_FLOAT_EQ(MakeConsistencyThresholds(options).max_depth_error, 0.02f);
}

TEST_F(ConsistencyTest, TriangulationAngle) {
  thresholds_.max_ray_cosine = std::cos(0.20f);  // the angle is about 0.23 radian here
  EXPECT_TRUE(Consistent(2.0f));
  thresholds_.max_ray_cosine = std::cos(0.27f);
  EXPECT_FALSE(Consistent(2.0f));
}

TEST_F(ConsistencyTest, NoDepthInTheSourceOrOutsideOfIt) {
  map_ = PlaneMap(80, 60);
  EXPECT_FALSE(Consistent(2.0f));
  EXPECT_EQ(AskAt(60.5f, {{0, 0, -1}, 2.0f}), Testimony::kFindsNothing);
  EXPECT_EQ(AskAt(10.5f, {{0, 0, -1}, 2.0f}), Testimony::kNone);
}

TEST_F(ConsistencyTest, DepthIsNotBlendedAcrossAnEdge) {
  map_ = PlaneMap(80, 60);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) map_(x, y).depth = x < 40 ? 2.0f : 3.0f;
  }
  EXPECT_EQ(InterpolatedDepth(ReadTaps(map_.view(), 39.9f, 20.5f), Formulas::kRobust), 2.0f);
  EXPECT_EQ(InterpolatedDepth(ReadTaps(map_.view(), 40.1f, 20.5f), Formulas::kRobust), 3.0f);
}

TEST_F(ConsistencyTest, ThePaperInterpolatesWhereverThereIsDepth) {
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) map_(x, y).depth = x < 40 ? 2.0f : 3.0f;
  }
  // 0.6 of the way from the centre of column 39 to that of column 40.
  EXPECT_NEAR(InterpolatedDepth(ReadTaps(map_.view(), 40.1f, 20.5f), Formulas::kPaper), 2.6f, 1e-5);
  map_(39, 20).depth = 0;
  EXPECT_EQ(InterpolatedDepth(ReadTaps(map_.view(), 40.1f, 20.5f), Formulas::kPaper), 3.0f);
}

TEST_F(ConsistencyTest, ALengthTakesThePlaceOfTheRelativeError) {
  thresholds_.max_reprojection_error = 10;
  thresholds_.max_depth_error = 0.02f;
  EXPECT_TRUE(Consistent(2.0198f));
  EXPECT_FALSE(Consistent(2.0202f));
  FilterOptions options;
  options.max_depth_error = 0.03;
  EXPECT_EQ(MakeConsistencyThresholds(options).max_depth_error, 0.03f);
}

// The filter of the fixture's map, whose source views have the same map.
class FilterTest : public ConsistencyTest {
 protected:
  FilterTest() {
    SetStates({});
    AddSource();
  }
  // Of the reference's map; empty: an estimate.
  void SetStates(const StateMap& states) {
    input_.reference = {&reference_view_,
                        std::make_shared<const MeasurementMap>(MeasurementMap{map_, states})};
  }
  void AddSource() { AddMap(2); }
  void AddContradictingSource() { AddMap(2.4f); }
  // Another source view at the same place, whose map is a plane at this depth.
  void AddMap(float depth) {
    input_.sources.push_back(
        {&source_view_, [map = Estimate(PlaneMap(80, 60, {{0, 0, -1}, depth}))] { return map; }});
  }
  static std::shared_ptr<const MeasurementMap> Estimate(const PlaneMap& map) {
    return std::make_shared<const MeasurementMap>(MeasurementMap{map, {}});
  }
  PixelState StateAt(int x, int y) const {
    const MeasurementMap kept = FilterOnCpu(input_, options_);
    EXPECT_EQ(kept.planes(x, y).depth > 0, kept.states(x, y) != PixelState::kNone);
    return kept.states(x, y);
  }
  bool Keeps(int x, int y) const { return StateAt(x, y) != PixelState::kNone; }

  const SceneView reference_view_{"a", 1, reference_}, source_view_{"b", 2, source_};
  FilterInput input_;
  FilterOptions options_ = {.min_num_consistent = 2};
};

TEST_F(FilterTest, WantsTwoViewsAndSparesInferredPixelsTheCostTest) {
  AddContradictingSource();
  EXPECT_FALSE(Keeps(60, 30));
  AddSource();
  EXPECT_TRUE(Keeps(60, 30));
  EXPECT_FALSE(Keeps(10, 30));  // seen by the reference alone

  input_.cost = std::make_shared<CostMap>(80, 60, 1.0f);
  options_.min_ncc = 0.1;
  EXPECT_FALSE(Keeps(60, 30));
  SetStates(StateMap(80, 60, PixelState::kInferredConfirmed));
  EXPECT_TRUE(Keeps(60, 30));
}

// One view confirms, and no other one could: the pixel is kept.
TEST_F(FilterTest, OneViewIsEnoughWhereNoOtherCanSee) {
  EXPECT_EQ(StateAt(60, 30), PixelState::kMeasured);
  AddSource();
  EXPECT_EQ(StateAt(60, 30), PixelState::kMeasured);
  input_.sources.pop_back();
  AddContradictingSource();  // it sees another surface behind
  EXPECT_EQ(StateAt(60, 30), PixelState::kNone);
  input_.sources.pop_back();
  AddMap(1.9f);  // 5 % before the point: hidden from this one
  EXPECT_EQ(StateAt(60, 30), PixelState::kMeasured);
  options_.method.rules.Set(Rule::kFewViews, 0);
  EXPECT_EQ(StateAt(60, 30), PixelState::kNone);
  options_.method.rules = {};
  options_.method.formulas = Formulas::kPaper;
  EXPECT_EQ(StateAt(60, 30), PixelState::kNone);
}

// The pixel's depth falls on the sources' pixel (35, 30): 25 pixels to the left of its own. Its mask may have taken away what
// stood before the surface.
TEST_F(FilterTest, WhatAViewLeavesOutTestifiesNothing) {
  options_.max_normal_error = 60;
  AddContradictingSource();
  const auto mask = std::make_shared<ImageMask>(80, 60, 255);
  input_.sources[1].load_mask = [mask] { return mask; };
  EXPECT_FALSE(Keeps(60, 30));
  for (const auto& [x, y] : {std::pair(34, 30), std::pair(36, 30), std::pair(35, 29), std::pair(35, 31)})
    (*mask)(x, y) = 0;
  EXPECT_FALSE(Keeps(60, 30));
  (*mask)(35, 30) = 0;
  EXPECT_TRUE(Keeps(60, 30));
  input_.sources[0].load_mask = [mask] { return mask; };
  EXPECT_FALSE(Keeps(60, 30));
}

// Of the tolerances, 1 % and one pixel, 0.4 and 0.5: depth 2 moves by 25 pixels between the views, and by half of one
// where it is 2.04.
TEST_F(FilterTest, AViewAloneMustConfirmClosely) {
  options_.max_normal_error = 60;
  for (const auto& [depth, is_kept] : {std::pair(2.0f * 1.0039f, true), std::pair(2.0f * 1.0045f, false)}) {
    input_.sources.clear();
    AddMap(depth);
    EXPECT_EQ(Keeps(60, 30), is_kept) << depth;
  }
  options_.max_relative_depth_error = 0.05;
  for (const auto& [depth, is_kept] :
       {std::pair(1 / (0.5f - 0.48f / 50), true), std::pair(1 / (0.5f - 0.52f / 50), false)}) {
    input_.sources.clear();
    AddMap(depth);
    EXPECT_EQ(Keeps(60, 30), is_kept) << depth;
  }
}

// What a view could see: the point inside its image with room for a window, the surface not edge-on.
TEST_F(FilterTest, ViewsThatCannotSeeAreNoWitnesses) {
  map_ = PlaneMap(80, 60, {{0, 0, -1}, 2.4f});  // contradicts depth 2
  const auto ask = [&](float u, Vec3f normal) { return AskAt(u, {normal, 2.0f}); };
  // Depth 2 at column u lies at u - 25 of the source.
  EXPECT_EQ(ask(25 + 5.5f, {0, 0, -1}), Testimony::kContradicts);
  EXPECT_EQ(ask(25 + 4.5f, {0, 0, -1}), Testimony::kNone);
  // The source's ray at the middle is (-0.045, 0.005, 1): an angle of 79 degrees to the first normal, 82 to the second.
  const float middle = 60.5f;
  EXPECT_EQ(ask(middle, {0.975f, 0, -0.222f}), Testimony::kContradicts);
  EXPECT_EQ(ask(middle, {0.995f, 0, -0.0999f}), Testimony::kNone);
}

// Before inference two views are asked for; after it the measured pixels have been judged.
TEST_F(FilterTest, MeasuredPixelsAreNotAskedForAgain) {
  AddContradictingSource();
  EXPECT_FALSE(Keeps(60, 30));
  SetStates(StateMap(80, 60, PixelState::kMeasured));
  EXPECT_TRUE(Keeps(60, 30));
  options_.method.formulas = Formulas::kPaper;
  EXPECT_FALSE(Keeps(60, 30));
}

TEST_F(FilterTest, InferredPixelsHaveTheirOwnNumberOfViews) {
  AddContradictingSource();
  options_.min_num_consistent_inferred = 1;
  EXPECT_FALSE(Keeps(60, 30));
  for (const PixelState state : {PixelState::kInferredConfirmed, PixelState::kInferredAlone}) {
    SetStates(StateMap(80, 60, state));
    EXPECT_EQ(StateAt(60, 30), PixelState::kInferredConfirmed) << "the filter found a view that agrees";
  }
}

// Depth 2 moves by 25 pixels between the views, and by 0.25 less where it is 1 % more.
TEST_F(FilterTest, InferredPixelsAreComparedByDepthAlone) {
  options_.max_reprojection_error = 0.1;
  const auto keeps = [&](PixelState state, float depth) {
    SetStates(StateMap(80, 60, state));
    input_.sources.clear();
    AddMap(depth);
    return Keeps(60, 30);
  };
  EXPECT_TRUE(keeps(PixelState::kInferredAlone, 2.016f));
  EXPECT_FALSE(keeps(PixelState::kInferredAlone, 2.024f));
  // An estimate's pixels count.
  options_.min_num_consistent = 1;
  input_.sources.clear();
  AddMap(2.016f);
  SetStates({});
  EXPECT_FALSE(Keeps(60, 30));
  options_.max_reprojection_error = 1;
  EXPECT_TRUE(Keeps(60, 30));
  options_.max_reprojection_error = 0.1;
  options_.method.rules.Set(Rule::kFilterTolerances, 0);
  EXPECT_FALSE(keeps(PixelState::kInferredAlone, 2.016f));
  options_.method.rules = {};
  options_.method.formulas = Formulas::kPaper;
  EXPECT_FALSE(keeps(PixelState::kInferredAlone, 2.016f));
}

// The reference and one view carry the depth: twice as many that find nothing drop it.
TEST_F(FilterTest, WhatMostViewsFindEmptyIsNotFilled) {
  const auto set_empty_views = [&](int count) {
    input_.sources.clear();
    AddSource();
    for (int i = 0; i < count; ++i) AddMap(0);
  };
  options_.min_num_consistent = options_.min_num_consistent_inferred = 1;
  SetStates(StateMap(80, 60, PixelState::kInferredAlone));
  set_empty_views(3);
  EXPECT_TRUE(Keeps(60, 30));
  set_empty_views(4);
  EXPECT_FALSE(Keeps(60, 30));
  const auto mask = std::make_shared<ImageMask>(80, 60, 0);
  input_.sources.back().load_mask = [mask] { return mask; };
  EXPECT_TRUE(Keeps(60, 30)) << "what a view leaves out is not empty";
  set_empty_views(4);
  std::swap(input_.sources.front(), input_.sources.back());
  EXPECT_FALSE(Keeps(60, 30)) << "whoever is asked first";
  AddSource();
  EXPECT_TRUE(Keeps(60, 30)) << "three carry it, four do not";
  set_empty_views(4);
  for (int i = 0; i < 4; ++i) AddContradictingSource();
  EXPECT_FALSE(Keeps(60, 30)) << "four and another surface";
  set_empty_views(3);
  for (int i = 0; i < 4; ++i) AddContradictingSource();
  EXPECT_TRUE(Keeps(60, 30)) << "another surface is not nothing";
}

TEST_F(FilterTest, EmptyViewsSayNothingOfAMeasurementNorWhereNobodyIsAsked) {
  options_.min_num_consistent = options_.min_num_consistent_inferred = 1;
  for (int i = 0; i < 9; ++i) AddMap(0);
  EXPECT_TRUE(Keeps(60, 30));
  SetStates(StateMap(80, 60, PixelState::kInferredAlone));
  EXPECT_FALSE(Keeps(60, 30));
  options_.min_num_consistent_inferred = 0;
  EXPECT_TRUE(Keeps(60, 30));
  options_.min_num_consistent_inferred = 1;
  options_.method.rules.Set(Rule::kEmptyViews, 0);
  EXPECT_TRUE(Keeps(60, 30));
  options_.method.rules.Set(Rule::kEmptyViews, 3);  // nine of two are not six for each
  EXPECT_TRUE(Keeps(60, 30));
  options_.method.rules = {};
  options_.method.formulas = Formulas::kPaper;
  std::swap(input_.sources.front(), input_.sources.back());  // it asks no more views than it needs: first those that find nothing
  EXPECT_TRUE(Keeps(60, 30));
}

TEST_F(FilterTest, KeepsADepthThatNoViewNeedsToConfirm) {
  input_.sources.clear();
  EXPECT_FALSE(Keeps(60, 30));
  options_.min_num_consistent = 0;
  EXPECT_TRUE(Keeps(60, 30));
}

// A pixel's count of views is a byte.
TEST_F(FilterTest, AsksForNoMoreViewsThanItCounts) {
  options_.min_num_consistent = options_.min_num_consistent_inferred = 255;
  EXPECT_EQ(options_.Check(), "");
  options_.min_num_consistent = 256;
  EXPECT_EQ(
      options_.Check(),
      "--PatchMatchStereo.filter_min_num_consistent is 256, but must be between 0 and 255 source views");
  options_.min_num_consistent = 255;
  options_.min_num_consistent_inferred = 256;
  EXPECT_NE(options_.Check(), "");
  // Of 300 that agree.
  options_.min_num_consistent_inferred = 1;
  for (int j = 1; j < 300; ++j) AddSource();
  EXPECT_TRUE(Keeps(60, 30));
}

TEST_F(FilterTest, ViewsWithoutAMapTakeNoPart) {
  AddContradictingSource();
  input_.sources.push_back({&source_view_, nullptr});
  EXPECT_FALSE(Keeps(60, 30));
}

// However long the list of sources is, no more than one of their maps is in memory.
TEST_F(FilterTest, HoldsOneSourceMapAtATime) {
  input_.sources.clear();
  int num_held = 0, most_held = 0, num_loads = 0;
  for (int j = 0; j < 20; ++j) {
    input_.sources.push_back({&source_view_, [&] {
                                ++num_loads;
                                most_held = std::max(most_held, ++num_held);
                                return std::shared_ptr<MeasurementMap>(new MeasurementMap{map_, {}},
                                                                       [&](MeasurementMap* map) {
                                                                         --num_held;
                                                                         delete map;
                                                                       });
                              }});
  }
  options_.min_num_consistent = 20;
  EXPECT_TRUE(Keeps(60, 30));
  EXPECT_EQ(num_loads, 20);
  EXPECT_EQ(most_held, 1);
  EXPECT_EQ(num_held, 0);
}

// Sources of which every pixel has another number that confirm it, from none to all.
TEST_F(FilterTest, TurnsOfAnySizeGiveTheSameBytes) {
  constexpr int kNumSources = 7;
  std::vector<std::shared_ptr<MeasurementMap>> maps;
  input_.sources.clear();
  for (int j = 0; j < kNumSources; ++j) {
    maps.push_back(std::make_shared<MeasurementMap>(MeasurementMap{map_, {}}));
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 80; ++x)
        maps[j]->planes(x, y).depth *= (x + 3 * y) % (kNumSources + 1) > j ? 1 : 1.2f;
    }
    input_.sources.push_back({&source_view_, [map = maps[j]] { return map; }});
  }
  StateMap reference_states(80, 60, PixelState::kInferredAlone);
  for (int x = 0; x < 80; ++x) reference_states(x, 20) = PixelState::kMeasured;
  SetStates(reference_states);
  options_.min_num_consistent = 3;
  options_.min_num_consistent_inferred = 5;
  const PlaneMap whole = FilterOnCpu(input_, options_).planes;
  const auto num_kept = std::count_if(whole.begin(), whole.end(), [](const auto& h) { return h.depth > 0; });
  EXPECT_GT(num_kept, 80 * 60 / 4);
  EXPECT_LT(num_kept, 80 * 60 * 3 / 4);

  const FilterReference reference = MakeFilterReference(input_, options_);
  for (const int turn_size : {1, 2, 3, kNumSources}) {
    Array2D<Testimonies> testimonies(80, 60);
    for (int begin = 0; begin < kNumSources; begin += turn_size) {
      std::vector<FilterSource> sources;
      for (int j = begin; j < std::min(begin + turn_size, kNumSources); ++j) {
        sources.push_back({view_, maps[j]->planes.view()});
      }
      const FilterTurn turn{sources.data(), static_cast<int>(sources.size())};
      for (int y = 0; y < 60; ++y) {
        for (int x = 0; x < 80; ++x) AskSources(reference, turn, x, y, &testimonies(x, y));
      }
    }
    Array2D<FilterVerdict> verdicts(80, 60);
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 80; ++x) verdicts(x, y) = JudgeByViews(reference, x, y, testimonies(x, y));
    }
    const PlaneMap kept = KeptPixels(*input_.reference.map, verdicts.data()).planes;
    EXPECT_EQ(std::memcmp(kept.data(), whole.data(), whole.bytes()), 0) << turn_size << " at once";
  }
}

// 80 pixels a row, which the CPU asks 64 at a time; rough maps with holes and a mask, so that each says something else.
TEST_F(FilterTest, PixelsAskedSideBySideSayWhatEachSaysAlone) {
  const auto rough = [](std::uint32_t key) {
    PlaneMap map(80, 60);
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Random4 random = Philox({0, key}, i, 0, 0);
      const auto share = [&](int j) { return static_cast<float>(random.v[j] >> 8) / (1 << 24); };
      map.data()[i] = {Normalized({share(1) - 0.5f, share(2) - 0.5f, -1}), random.v[3] % 16 == 0 ? 0 : 2 + 0.06f * (share(0) - 0.5f)};
    }
    return map;
  };
  source_.pose.rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const SceneView turned{"b", 2, source_};
  ImageMask mask(80, 60, 1);
  for (int y = 0; y < 60; ++y) std::fill(&mask(50, y), &mask(59, y), std::uint8_t{0});
  input_.reference.map = Estimate(rough(1));
  input_.sources = {{&turned, [map = Estimate(rough(2))] { return map; }, [mask] { return std::make_shared<const ImageMask>(mask); }}};
  Array2D<Testimonies> said;
  FilterOnCpu(input_, options_, &said);

  const FilterReference reference = MakeFilterReference(input_, options_);
  const PlaneMap map = rough(2);
  const FilterSource source{MakeRelativeView(reference_, source_), map.view(), mask.view()};
  std::array<int, 5> num_of = {};
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      Testimonies alone;
      AskSources(reference, {&source, 1}, x, y, &alone);
      EXPECT_EQ(std::memcmp(&said(x, y), &alone, sizeof alone), 0) << x << ", " << y;
      ++num_of[0];
      num_of[1] += alone.num_confirming, num_of[2] += alone.num_close, num_of[3] += alone.num_contradicting, num_of[4] += alone.num_empty;
    }
  }
  for (const int num : num_of) EXPECT_GT(num, 50);
}

}  // namespace
}  // namespace phi
