// --PhiStereo.mask_path: what is masked leaves no trace, in its own image and in the others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "tests/support/run_on_workspace.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::ReadMaps;
using test_support::TemporaryFolder;
using testing::HasSubstr;

constexpr int kWidth = 200, kHeight = 150, kNumViews = 4;

// What every image's mask leaves out.
bool IsMasked(int x, int y) { return x >= 70 && x < 110 && y >= 50 && y < 100; }

// A rendered room and a folder of masks.
class MaskedRoom : public testing::Test {
 protected:
  MaskedRoom() {
    test_support::MakeRoom(folder_.path(), kWidth, kHeight, kNumViews);
    for (const auto& entry : fs::directory_iterator(folder_ / "room/dense/images")) {
      names_.push_back(entry.path().filename());
      WriteMask(names_.back(), kWidth, kHeight);
    }
    fs::copy(folder_ / "room/dense", folder_ / "copy", fs::copy_options::recursive);
  }

  void WriteMask(const std::string& name, int width, int height) {
    phi::Mask mask(width, height, 255);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) mask(x, y) = IsMasked(x, y) ? 0 : 255;
    }
    fs::create_directories(folder_ / "masks");
    colmap_ext::WriteGrayImage(folder_ / "masks" / (name + ".png"), mask);
  }

  ProgramResult Run(const std::string& command, const fs::path& workspace, std::vector<std::string> more = {}) {
    return test_support::RunOnWorkspace(command, workspace, more);
  }
  ProgramResult RunMasked(const std::string& command, const fs::path& workspace, std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--PhiStereo.mask_path", folder_ / "masks"});
    return Run(command, workspace, more);
  }
  // Where it does not matter how good the maps are.
  ProgramResult RunMaskedOnce(const fs::path& workspace) {
    return RunMasked("patch_match_stereo", workspace, {"--PatchMatchStereo.num_iterations", "1"});
  }

  phi::Array2D<float> Depth(const fs::path& workspace, const std::string& name, const std::string& kind) {
    return colmap_ext::ReadDepthMap(workspace / "stereo/depth_maps" / (name + "." + kind + ".bin"));
  }
  // Unmasked pixels near the mask whose depth is within 1 % of the truth, over all such pixels.
  double RightShareBesideTheMask(const fs::path& workspace, const std::string& kind) {
    constexpr int kBeside =
        4;  // pixels: most of a matching window lies in the mask, or in that of another view
    int num = 0, num_right = 0;
    for (const std::string& name : names_) {
      const auto depth = Depth(workspace, name, kind);
      const auto truth = colmap_ext::ReadDepthMap(folder_ / "room/truth/depth_maps" / (name + ".bin"));
      for (int y = 50 - kBeside; y < 100 + kBeside; ++y) {
        for (int x = 70 - kBeside; x < 110 + kBeside; ++x) {
          if (IsMasked(x, y)) continue;
          ++num;
          num_right += std::abs(depth(x, y) / truth(x, y) - 1) < 0.01f;
        }
      }
    }
    return static_cast<double>(num_right) / num;
  }

  TemporaryFolder folder_;
  std::vector<std::string> names_;
};

// Noise under the masks of the copy: the same bytes come out, so that nothing was read there by any stage for any view.
TEST_F(MaskedRoom, WhatIsMaskedLeavesNoTrace) {
  std::mt19937 random(1);
  for (const std::string& name : names_) {
    const fs::path path = folder_ / "copy/images" / name;
    phi::GrayImage image = colmap_ext::ReadGrayImage(path);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (IsMasked(x, y)) image(x, y) = static_cast<std::uint8_t>(random());
      }
    }
    colmap_ext::WriteGrayImage(path, image);
    colmap_ext::WriteGrayImage(folder_ / "room/dense/images" / name,
                               colmap_ext::ReadGrayImage(folder_ / "room/dense/images" / name));
  }
  for (const fs::path& workspace : {folder_ / "room/dense", folder_ / "copy"}) {
    const ProgramResult result = RunMasked("patch_match_stereo", workspace);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  const auto maps = ReadMaps(folder_ / "room/dense");
  EXPECT_EQ(maps.size(), kNumViews * 8u);
  EXPECT_EQ(maps, ReadMaps(folder_ / "copy"));
  for (const std::string& name : names_) {
    for (const std::string kind : {"photometric", "measured", "geometric"}) {
      const auto depth = Depth(folder_ / "copy", name, kind);
      int num_outside = 0;
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          if (IsMasked(x, y)) {
            ASSERT_EQ(depth(x, y), 0) << name << " " << kind;
          } else {
            num_outside += depth(x, y) > 0;
          }
        }
      }
      EXPECT_GT(num_outside, kWidth * kHeight / 4) << name << " " << kind;  // there was something to leave a trace in
    }
  }
}

// The windows there use what is outside the mask, of the reference and of its sources: they find nearly what they find without
// masks (0.97 of it; 0.79 where the sources' masks were edges to match). Fewer views can confirm it, since the other images'
// masks hide many of these surfaces, but a masked view contradicts none (0.65; 0.59 where it did).
TEST_F(MaskedRoom, SurfacesBesideTheMaskAreFound) {
  const fs::path masked = folder_ / "room/dense", whole = folder_ / "copy";
  ASSERT_EQ(RunMasked("patch_match_stereo", masked).exit_code, 0);
  ASSERT_EQ(Run("patch_match_stereo", whole).exit_code, 0);
  for (const auto& [kind, least] : {std::pair("photometric", 0.9), std::pair("measured", 0.62)}) {
    const double share = RightShareBesideTheMask(masked, kind),
                 without_masks = RightShareBesideTheMask(whole, kind);
    RecordProperty(kind, std::to_string(share / without_masks));
    EXPECT_GT(without_masks, 0.3) << kind;
    EXPECT_GT(share, least * without_masks) << kind;
  }
}

TEST_F(MaskedRoom, AnotherMaskMakesTheMapsAgain) {
  const fs::path workspace = folder_ / "room/dense";
  ASSERT_EQ(RunMaskedOnce(workspace).exit_code, 0);
  EXPECT_THAT(RunMaskedOnce(workspace).errors, HasSubstr("nothing to do"));
  phi::Mask mask(kWidth, kHeight, 255);
  for (int x = 0; x < kWidth; ++x) mask(x, 20) = 0;
  colmap_ext::WriteGrayImage(folder_ / "masks" / (names_[0] + ".png"), mask);
  const ProgramResult result = RunMaskedOnce(workspace);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  const auto depth = Depth(workspace, names_[0], "geometric");
  for (int x = 0; x < kWidth; ++x) ASSERT_EQ(depth(x, 20), 0);
}

// At half the size a pixel is masked that covers any masked one: columns 35 to 54, rows 25 to 49.
TEST_F(MaskedRoom, HoleFillerLeavesMaskedPixelsOpen) {
  const fs::path workspace = folder_ / "room/dense";
  ASSERT_EQ(Run("patch_match_stereo", workspace, {"--PatchMatchStereo.max_image_size", "100"}).exit_code, 0);
  const ProgramResult result =
      Run("hole_filler", workspace,
          {"--PatchMatchStereo.max_image_size", "100", "--PhiStereo.mask_path", folder_ / "masks"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const std::string& name : names_) {
    const auto depth = Depth(workspace, name, "geometric");
    int num_outside = 0;
    for (int y = 0; y < depth.height(); ++y) {
      for (int x = 0; x < depth.width(); ++x) {
        if (x >= 35 && x < 55 && y >= 25 && y < 50) {
          ASSERT_EQ(depth(x, y), 0) << x << ", " << y;
        } else {
          num_outside += depth(x, y) > 0;
        }
      }
    }
    EXPECT_GT(num_outside, kWidth * kHeight / 4 / 3);
  }
}

TEST_F(MaskedRoom, MasksOfAnotherSizeAreRefused) {
  WriteMask(names_[1], kWidth, kHeight - 1);
  const ProgramResult result = RunMaskedOnce(folder_ / "room/dense");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.errors, HasSubstr(names_[1] + ".png: the mask is 200x149 pixels but its image is 200x150"));
  fs::remove(folder_ / "masks" / (names_[1] + ".png"));
  const ProgramResult one_less = RunMaskedOnce(folder_ / "room/dense");
  EXPECT_EQ(one_less.exit_code, 0);
  EXPECT_THAT(one_less.errors, HasSubstr("1 of 4 images have no mask and are used whole"));
  const ProgramResult none =
      Run("patch_match_stereo", folder_ / "room/dense", {"--PhiStereo.mask_path", folder_ / "none"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.errors, HasSubstr("--PhiStereo.mask_path: there is no folder"));
}

}  // namespace
