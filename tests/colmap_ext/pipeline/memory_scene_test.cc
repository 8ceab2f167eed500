#include "colmap_ext/pipeline/memory_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
    options_.filter.formulas = phi::Formulas::kPaper;  // noise has no neighbours that agree
    backends_.push_back(std::make_unique<test_support::FakeBackend>(&calls_, 2));
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
    EXPECT_EQ(map.problem, "");
    ASSERT_NE(map.inferred, nullptr);
    std::int64_t num_inferred = 0;
    for (std::size_t i = 0; i < map.map->size(); ++i) {
      const bool is_inferred = map.inferred->data()[i] != 0;
      num_inferred += is_inferred;
      if (is_inferred) EXPECT_GT(map.map->data()[i].depth, 0);
    }
    EXPECT_GT(num_inferred, 0);
  }
}

TEST_F(MemorySceneTest, AnImageThatCannotBeDoneIsToldAndTheOthersGoOn) {
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "filter" && image == names_[1]) throw phi::InputError("no luck with " + image);
  };
  const Workspace workspace = InMemory();
  const std::vector<SceneMaps> maps = EstimateScene(workspace, Sources(), options_, backends_);
  EXPECT_THAT(maps[1].problem, HasSubstr("no luck with " + names_[1]));
  EXPECT_EQ(maps[1].inferred, nullptr);
  for (const phi::PlaneHypothesis& h : *maps[1].map) EXPECT_EQ(h.depth, 0);
  EXPECT_EQ(maps[0].problem, "");
  EXPECT_EQ(calls_.inferences, static_cast<int>(names_.size()) - 1);
}

TEST_F(MemorySceneTest, FillingStartsFromMapsThatAreThere) {
  const Workspace workspace = InMemory();
  std::vector<std::shared_ptr<const phi::PlaneMap>> measured;
  for (const phi::SceneView& view : workspace.views()) {
    phi::PlaneMap map(view.camera.pinhole.width, view.camera.pinhole.height, {{0, 0, -1}, 2});
    map(3, 2) = {};
    measured.push_back(std::make_shared<const phi::PlaneMap>(std::move(map)));
  }
  const std::vector<SceneMaps> maps = FillScene(workspace, Sources(), measured, options_, backends_);
  EXPECT_EQ(calls_.estimates, 0);
  EXPECT_EQ(calls_.filters, static_cast<int>(names_.size()));
  EXPECT_EQ((*maps[0].inferred)(3, 2), 255);
  EXPECT_EQ((*maps[0].inferred)(4, 2), 0);
  EXPECT_GT((*maps[0].map)(3, 2).depth, 0);
}

}  // namespace
}  // namespace colmap_ext
