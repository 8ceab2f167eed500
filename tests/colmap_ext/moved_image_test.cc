#include "colmap_ext/moved_image.h"

#include <cmath>

#include <gtest/gtest.h>

namespace colmap_ext {
namespace {

constexpr int kWidth = 120, kHeight = 80;

// Brightness at K's coordinates: smooth, and another in every direction.
double Brightness(double u, double v) { return 128 + 60 * std::sin(u / 9) + 50 * std::cos(v / 7); }

phi::GrayImage Photo(double pixels_per_pixel) {
  phi::GrayImage photo(static_cast<int>(kWidth / pixels_per_pixel),
                       static_cast<int>(kHeight / pixels_per_pixel));
  for (int y = 0; y < photo.height(); ++y) {
    for (int x = 0; x < photo.width(); ++x) {
      photo(x, y) = static_cast<std::uint8_t>(
          std::lround(Brightness((x + 0.5) * pixels_per_pixel, (y + 0.5) * pixels_per_pixel)));
    }
  }
  return photo;
}

// Of the moved photo against what the photo shows at the offset, inside of the border.
double LargestDifference(const phi::GrayImage& moved, const phi::ImageCorrection& correction,
                         double pixels_per_pixel) {
  double largest = 0;
  for (int y = 4; y < moved.height() - 4; ++y) {
    for (int x = 4; x < moved.width() - 4; ++x) {
      const double u = (x + 0.5) * pixels_per_pixel, v = (y + 0.5) * pixels_per_pixel;
      const Eigen::Vector2d at = Eigen::Vector2d(u, v) + correction.Offset(u, v);
      largest = std::max(largest, std::abs(moved(x, y) - Brightness(at.x(), at.y())));
    }
  }
  return largest;
}

phi::ImageCorrection Correction() {
  phi::ImageCorrection correction({kWidth, kHeight, 100, 100, 60, 40});
  correction.coefficients << 0.6, -0.8, 0.3, 0.2, -0.4, 0.1, 0.5, 0.3, -0.2, 0.4, 0.1, -0.3;
  return correction;
}

// Rounding, twice, and a fiftieth of a pixel, which is 0.15 grey levels here. A tenth more or less is 0.7, half a pixel 3.5.
TEST(MoveImage, ShowsWhatThePhotoShowsAtTheOffset) {
  EXPECT_LT(LargestDifference(MoveImage(Photo(1), Correction()), Correction(), 1), 1.6);
}

TEST(MoveImage, OffsetsAreOfTheModelsImage) {
  EXPECT_LT(LargestDifference(MoveImage(Photo(0.5), Correction()), Correction(), 0.5), 1.6);
}

TEST(MoveImage, MovesByWholePixels) {
  const phi::GrayImage photo = Photo(1);
  phi::ImageCorrection correction({kWidth, kHeight, 100, 100, 60, 40});
  correction.coefficients.row(0) << 3, -2;
  const phi::GrayImage moved = MoveImage(photo, correction);
  ASSERT_EQ(moved.width(), kWidth);
  ASSERT_EQ(moved.height(), kHeight);
  EXPECT_EQ(moved(50, 40), photo(53, 38));
  EXPECT_EQ(moved(kWidth - 1, 0), photo(kWidth - 1, 0)) << "the border goes on";
}

TEST(ImageCorrection, TermsAreOneAtTheEndsOfTheLongerSide) {
  phi::ImageCorrection correction({kWidth, kHeight, 100, 100, 60, 40});
  EXPECT_EQ(correction.MeanOffset(), 0);
  correction.coefficients.row(3) << 1, 0;  // x
  EXPECT_DOUBLE_EQ(correction.Offset(kWidth, 17).x(), 1);
  EXPECT_DOUBLE_EQ(correction.Offset(0, 17).x(), -1);
  EXPECT_DOUBLE_EQ(correction.Offset(kWidth / 2.0, 17).x(), 0);
  correction.coefficients.setZero();
  correction.coefficients.row(1) << 0, 1;  // y
  EXPECT_DOUBLE_EQ(correction.Offset(5, kHeight).y(), static_cast<double>(kHeight) / kWidth);
  EXPECT_NEAR(correction.LargestOffset(), 7.0 / 8 * kHeight / kWidth, 1e-12) << "of the grid's middles";
}

}  // namespace
}  // namespace colmap_ext
