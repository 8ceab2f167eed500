#include "colmap_ext/pipeline/image_moves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/pinhole_camera.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

// Four pixels of the model's image are two of the working one, which is half as wide.
TEST(PoseWarning, NamesAllOffsetsInPixelsOfTheWorkingImages) {
  const test_support::TemporaryFolder folder;
  test_support::WriteSmallWorkspace(folder.path());
  WorkspaceOptions options;
  options.path = folder.path();
  options.max_image_size = 16;
  const Workspace workspace(options);
  phi::ImageCorrections corrections;
  corrections.mean_offset = 1;
  for (const SparseImage& image : workspace.model().images)
    corrections.of_view.emplace_back(MakePinhole(workspace.model().cameras.at(image.camera_id)));
  corrections.of_view[0].coefficients(0, 0) = 4;
  const std::string warning = PoseWarning(corrections, MakeSparseScene(workspace.model()), workspace);
  EXPECT_THAT(warning, testing::HasSubstr("at 16 pixels the photos show the sparse points 1.0 pixels beside"));
  EXPECT_THAT(warning, testing::HasSubstr("a.png by up to 2.0 pixels"));
}

}  // namespace
}  // namespace colmap_ext
