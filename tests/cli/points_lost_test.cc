// scripts/points_lost on two cameras before a wall, 2 units away, whose maps are right and wrong by columns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/sparse_model.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using colmap_ext::SparseImage;
using phi::Array2D;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;

namespace fs = std::filesystem;

constexpr int kWidth = 40, kHeight = 30;

class PointsLost : public testing::Test {
 protected:
  void SetUp() override {
    if (RunProgram({"python3", "-c", "import numpy, PIL"}).exit_code != 0) {
      GTEST_SKIP() << "no python3 with numpy and Pillow";
    }
    colmap_ext::SparseModel model;
    model.cameras[1] = {1, 1, kWidth, kHeight, {20, 20, 20, 15}};
    // The second camera stands one unit to the right: 20 * 1 / 2 = 10 pixels of disparity on the wall.
    for (int i = 0; i < 2; ++i) {
      SparseImage image;
      image.image_id = i + 1;
      image.camera_id = 1;
      image.name = i == 0 ? "left.png" : "right.png";
      image.translation = Eigen::Vector3d(-i, 0, 0);
      model.images.push_back(image);
      colmap_ext::WriteDepthMap(folder_ / "truth" / (image.name + ".bin"),
                                Array2D<float>(kWidth, kHeight, 2.0f));
    }
    fs::create_directories(dense_ / "sparse");
    WriteSparseModelBinary(model, dense_ / "sparse");
    WriteMaps();
  }

  // Columns 0 to 9: filled, right; 10 to 19: filled, wrong; 20 to 29: measured, right; 30 to 34: measured, wrong;
  // 35 to 39: no depth. The raw map is right everywhere; the photo is plain on the left and chequered on the right.
  void WriteMaps() const {
    Array2D<float> geometric(kWidth, kHeight, 2.0f), measured(kWidth, kHeight, 0.0f);
    phi::Mask filled(kWidth, kHeight);
    phi::GrayImage photo(kWidth, kHeight, 100);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (x < 20) filled(x, y) = 255;
        if ((x >= 10 && x < 20) || (x >= 30 && x < 35)) geometric(x, y) = 2.5f;
        if (x >= 35) geometric(x, y) = 0;
        if (x >= 20) measured(x, y) = geometric(x, y);
        if (x >= 20 && (x / 2 + y / 2) % 2 == 0) photo(x, y) = 200;
      }
    }
    const fs::path maps = dense_ / "stereo/depth_maps";
    colmap_ext::WriteDepthMap(maps / "left.png.photometric.bin", Array2D<float>(kWidth, kHeight, 2.0f));
    colmap_ext::WriteDepthMap(maps / "left.png.measured.bin", measured);
    colmap_ext::WriteDepthMap(maps / "left.png.geometric.bin", geometric);
    fs::create_directories(dense_ / "stereo/filled_masks");
    fs::create_directories(dense_ / "images");
    colmap_ext::WriteMask(dense_ / "stereo/filled_masks/left.png.png", filled);
    colmap_ext::WriteGrayImage(dense_ / "images/left.png", photo);
  }

  ProgramResult Run() const {
    return RunProgram({"python3", PHIMVS_SOURCE_DIR "/scripts/points_lost", "--workspace_path", dense_,
                       "--truth_depth_maps", folder_ / "truth", "--images", "left.png", "--stride", "1",
                       "--json_path", folder_ / "counts.json", "--picture_path", folder_ / "pictures"});
  }

  TemporaryFolder folder_;
  fs::path dense_ = folder_ / "dense";
};

TEST_F(PointsLost, CountsByClassOfSurface) {
  const ProgramResult result = Run();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto counts = nlohmann::json::parse(ReadBytes(folder_ / "counts.json"));
  const auto sum = [&](const std::string& subject, const std::string& figure) {
    double total = 0;
    for (const auto& [label, figures] : counts.at(subject).items()) total += figures.at(figure).get<double>();
    return total;
  };
  for (const std::string subject : {"texture", "other views that see it", "slant, degrees"}) {
    EXPECT_EQ(sum(subject, "pixels"), kWidth * kHeight) << subject;
    EXPECT_EQ(sum(subject, "raw_right"), kWidth * kHeight) << subject;
    EXPECT_EQ(sum(subject, "kept"), 15 * kHeight) << subject;
    EXPECT_EQ(sum(subject, "kept_right"), 10 * kHeight) << subject;
    EXPECT_EQ(sum(subject, "filled"), 20 * kHeight) << subject;
    EXPECT_EQ(sum(subject, "filled_right"), 10 * kHeight) << subject;
    EXPECT_EQ(sum(subject, "final_right"), 20 * kHeight) << subject;
  }
  // The other camera sees columns 10 and higher: those keep 20 wrong and 10 right of the final depths' columns.
  const auto& views = counts.at("other views that see it");
  EXPECT_EQ(views.at("0").at("pixels"), 10 * kHeight);
  EXPECT_EQ(views.at("0").at("filled_right"), 10 * kHeight);
  EXPECT_EQ(views.at("1").at("pixels"), 30 * kHeight);
  EXPECT_EQ(views.at("1").at("final_right"), 10 * kHeight);
  // A window of 15 x 15 pixels and its derivatives reach 8 columns: 0 to 11 see paint alone.
  EXPECT_GE(counts.at("texture").at("plain").at("pixels"), 12 * kHeight);
  EXPECT_LT(counts.at("texture").at("plain").at("pixels"), 16 * kHeight);
  EXPECT_GE(counts.at("texture").at("textured").at("pixels"), 16 * kHeight);
}

// A plane that turns away by 60 degrees, z = 1 + sqrt(3) x. Depths are too large by 3.086 cm in the upper half and by
// 3.053 cm in the lower; at the ray (x, y, 1) a unit of depth is |sqrt(3) x - 1| / 2 of surface, 0.6516 at pixel 16 and
// 0.608 at pixel 17. So 2 cm of surface are kept from pixel 17 on above and from 16 on below. Rays half a pixel off on
// either side (0.6447 or 0.6588 at pixel 16) would change one of them.
TEST_F(PointsLost, JudgesTheDistanceToASlantedSurface) {
  Array2D<float> truth(kWidth, kHeight, 0.0f), map(kWidth, kHeight, 0.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 28; ++x) {
      truth(x, y) = static_cast<float>(1 / (1 - std::sqrt(3.0) * (x + 0.5 - 20) / 20));
      map(x, y) = truth(x, y) + (y < 15 ? 0.03086f : 0.03053f);
    }
  }
  colmap_ext::WriteDepthMap(folder_ / "truth/left.png.bin", truth);
  for (const std::string kind : {"photometric", "measured", "geometric"}) {
    colmap_ext::WriteDepthMap(dense_ / "stereo/depth_maps" / ("left.png." + kind + ".bin"), map);
  }
  const ProgramResult result = Run();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto slants = nlohmann::json::parse(ReadBytes(folder_ / "counts.json")).at("slant, degrees");
  double near = 0, raw = 0, right = 0;
  for (const auto& [label, figures] : slants.items()) {
    near += figures.at("final_near").get<double>();
    raw += figures.at("raw_near").get<double>();
    right += figures.at("final_right").get<double>();
  }
  EXPECT_EQ(near, 15 * 11 + 15 * 12);
  EXPECT_EQ(raw, 15 * 11 + 15 * 12);
  EXPECT_EQ(right, 0) << "3 cm of depth are no 2 cm";
  EXPECT_THAT(result.output, testing::HasSubstr("near %"));
}

// Between two walls that face the camera no surface is slanted: a depth in the middle between them is near to neither.
TEST_F(PointsLost, StepsBetweenSurfacesAreNoSlant) {
  Array2D<float> truth(kWidth, kHeight, 2.0f), map(kWidth, kHeight, 0.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 20; x < kWidth; ++x) truth(x, y) = 4;
    map(19, y) = 2.5f;
    map(20, y) = 3.5f;
  }
  colmap_ext::WriteDepthMap(folder_ / "truth/left.png.bin", truth);
  colmap_ext::WriteDepthMap(dense_ / "stereo/depth_maps/left.png.geometric.bin", map);
  const ProgramResult result = Run();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto slants = nlohmann::json::parse(ReadBytes(folder_ / "counts.json")).at("slant, degrees");
  EXPECT_EQ(slants.at("75-90").at("pixels"), 0);
  for (const auto& [label, figures] : slants.items()) EXPECT_EQ(figures.at("final_near"), 0) << label;
}

TEST_F(PointsLost, PaintsWhatIsRightAndWrong) {
  const ProgramResult result = Run();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const ProgramResult strongest =
      RunProgram({"python3", "-c",
                  "import sys\nfrom PIL import Image\npicture = Image.open(sys.argv[1])\n"
                  "print(*picture.size, *('RGB'[max(range(3), key=picture.getpixel((x, 15)).__getitem__)] "
                  "for x in (5, 25, 32)))\n"
                  "r, g, b = picture.getpixel((15, 15))\nprint('orange', r > g > b)\n"
                  "print('dark', max(picture.getpixel((37, 15))) < 70)",
                  folder_ / "pictures/left.png.png"});
  EXPECT_EQ(strongest.output, "40 30 B G R\norange True\ndark True\n") << strongest.errors;
}

}  // namespace
