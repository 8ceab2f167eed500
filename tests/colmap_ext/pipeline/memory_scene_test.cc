#include "colmap_ext/pipeline/memory_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "colmap_ext/progress.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "tests/support/fake_backend.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using ::testing::HasSubstr;

// The photos of a workspace, in memory.
class MemorySceneTest : public ::testing::Test {
 protected:
  MemorySceneTest()
      : names_(test_support::WriteNoiseWorkspace(folder_.path())), stored_({.path = folder_.path()}) {
    options_.filter.method.formulas = phi::Formulas::kPaper;  // noise has no neighbours that agree
    backends_ = test_support::MakeFakeBackends(&calls_, 1, 2);
  }

  Workspace InMemory() const {
    std::vector<MemoryImage> images;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      images.push_back(
          {.pose = stored_.views()[i].camera.pose, .gray = stored_.ReadGray(static_cast<int>(i))});
    }
    return Workspace(stored_.model(), std::move(images), -1);
  }
  // Of each image all others.
  std::vector<std::vector<int>> Sources() const {
    const int n = static_cast<int>(names_.size());
    std::vector<std::vector<int>> sources(names_.size());
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        if (j != i) sources[i].push_back(j);
      }
    }
    return sources;
  }

  // Of each image its neighbour alone.
  std::vector<std::vector<int>> NeighbourSources() const {
    std::vector<std::vector<int>> sources = {{1}};
    for (int i = 1; i < static_cast<int>(names_.size()); ++i) sources.push_back({i - 1});
    return sources;
  }
  std::vector<std::shared_ptr<const phi::PlaneMap>> MapsWithAHole() const {
    std::vector<std::shared_ptr<const phi::PlaneMap>> measured;
    for (const phi::SceneView& view : stored_.views()) {
      phi::PlaneMap map(view.camera.pinhole.width, view.camera.pinhole.height, {{0, 0, -1}, 2});
      map(3, 2) = {};
      measured.push_back(std::make_shared<const phi::PlaneMap>(std::move(map)));
    }
    return measured;
  }
  void DoOneImageAtATime() { backends_ = test_support::MakeFakeBackends(&calls_, 1, 1); }

  test_support::TemporaryFolder folder_;
  std::vector<std::string> names_;
  Workspace stored_;
  test_support::FakeCalls calls_;
  PipelineOptions options_;
  Backends backends_;
};

TEST_F(MemorySceneTest, RunsEachStageOverEachImage) {
  const Workspace workspace = InMemory();
  const std::vector<SceneMaps> maps = EstimateScene(workspace, Sources(), options_, backends_);
  const int n = static_cast<int>(names_.size());
  EXPECT_EQ(calls_.estimates, n);
  EXPECT_EQ(calls_.filters, 2 * n);
  EXPECT_EQ(calls_.inferences, n);
  ASSERT_EQ(maps.size(), names_.size());
  for (const SceneMaps& map : maps) {
    EXPECT_EQ(map.problem.text, "");
    ASSERT_NE(map.inferred, nullptr);
    std::int64_t num_inferred = 0;
    for (std::size_t i = 0; i < map.map->size(); ++i) {
      const bool is_inferred = map.inferred->data()[i] != 0;
      num_inferred += is_inferred;
      if (is_inferred) {
        EXPECT_GT(map.map->data()[i].depth, 0);
      }
    }
    EXPECT_GT(num_inferred, 0);
  }
}

TEST_F(MemorySceneTest, AnImageGoesOnWhenWhatItReadsIsThere) {
  DoOneImageAtATime();
  const test_support::CallOrder order(&calls_);
  const Workspace workspace = InMemory();
  EstimateScene(workspace, NeighbourSources(), options_, backends_);
  EXPECT_EQ(order.size(), 4 * names_.size());
  for (std::size_t i = 1; i < names_.size(); ++i) {
    EXPECT_GT(order.Place("filter", names_[i]), order.Place("estimate", names_[i - 1]));
    EXPECT_GT(order.Place("infer", names_[i]), order.Place("filter", names_[i - 1]));
  }
  EXPECT_LT(order.Place("infer", names_.front()), order.Place("estimate", names_.back()));
}

TEST_F(MemorySceneTest, FillingHasNoBarrierEither) {
  DoOneImageAtATime();
  const test_support::CallOrder order(&calls_);
  const Workspace workspace = InMemory();
  FillScene(workspace, NeighbourSources(), MapsWithAHole(), options_, backends_);
  EXPECT_EQ(order.size(), 2 * names_.size());
  EXPECT_LT(order.Place("filter", names_.front()), order.Place("infer", names_.back()));
}

TEST_F(MemorySceneTest, StopsWhenAskedTo) {
  calls_.on_call = [](const std::string& stage, const std::string&) {
    if (stage == "filter") phi::CancellationFlag() = true;
  };
  const Workspace workspace = InMemory();
  EXPECT_THROW(EstimateScene(workspace, NeighbourSources(), options_, backends_), phi::Cancelled);
  phi::CancellationFlag() = false;
}

// Some images are filtered before those that read the failed one are planned again.
TEST_F(MemorySceneTest, ProgressCountsWhatIsDoneAlsoAfterAFailure) {
  ProgressState last;
  SetProgressSink([&](const ProgressState& state) { last = state; });
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "infer" && image == names_[1]) throw phi::InputError("no luck with " + image);
  };
  EstimateScene(InMemory(), NeighbourSources(), options_, backends_);
  SetProgressSink(nullptr);
  EXPECT_EQ(last.stage, "filtering");
  EXPECT_EQ(last.num_done, static_cast<int>(names_.size()) - 1);
  EXPECT_EQ(last.num_tasks, last.num_done);
  EXPECT_EQ(last.fraction, 1);
}

TEST_F(MemorySceneTest, AnImageThatCannotBeDoneIsToldAndTheOthersGoOn) {
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "filter" && image == names_[1]) throw phi::InputError("no luck with " + image);
  };
  const Workspace workspace = InMemory();
  const std::vector<SceneMaps> maps = EstimateScene(workspace, Sources(), options_, backends_);
  EXPECT_EQ(maps[1].problem.text, "no luck with " + names_[1]);
  EXPECT_EQ(maps[1].problem.image, names_[1]);
  EXPECT_EQ(maps[1].problem.stage, "measured");
  EXPECT_EQ(maps[1].inferred, nullptr);
  for (const phi::PlaneHypothesis& h : *maps[1].map) EXPECT_EQ(h.depth, 0);
  EXPECT_EQ(maps[0].problem.text, "");
  EXPECT_EQ(calls_.inferences, static_cast<int>(names_.size()) - 1);
}

TEST_F(MemorySceneTest, FillingStartsFromMapsThatAreThere) {
  const Workspace workspace = InMemory();
  calls_.on_infer = [](const phi::InferenceInput& input) { EXPECT_TRUE(input.keeps_measured); };
  const std::vector<SceneMaps> maps = FillScene(workspace, Sources(), MapsWithAHole(), options_, backends_);
  EXPECT_EQ(calls_.estimates, 0);
  EXPECT_EQ(calls_.filters, static_cast<int>(names_.size()));
  EXPECT_EQ((*maps[0].inferred)(3, 2), 255);
  EXPECT_EQ((*maps[0].inferred)(4, 2), 0);
  EXPECT_GT((*maps[0].map)(3, 2).depth, 0);
}

}  // namespace
}  // namespace colmap_ext
