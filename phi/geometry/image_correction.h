// Where a photo shows what its camera sees: beside it, where pose or lens are not quite what the camera says.
#pragma once

#include <array>

#include <Eigen/Core>

#include "phi/geometry/camera.h"

namespace phi {

// How far a photo's content lies beside its camera's projection: a polynomial of degree 2 in the position.
class ImageCorrection {
 public:
  static constexpr int kNumTerms = 6;
  using Terms = Eigen::Matrix<double, kNumTerms, 1>;
  using Coefficients =
      Eigen::Matrix<double, kNumTerms, 2>;  // pixels of the model's image; columns: along u, along v

  // Nothing is moved.
  explicit ImageCorrection(const Pinhole& model_pinhole);

  int model_width() const { return width_; }
  int model_height() const { return height_; }

  // 1, y, y^2, x, x y, x^2 with x, y from the image's middle, 1 at the ends of its longer side. u, v: pixels of the model's
  // image, K's coordinates.
  Terms TermsAt(double u, double v) const;
  // Pixels of the model's image: what the camera sees at (u, v), the photo shows at (u, v) + Offset.
  Eigen::Vector2d Offset(double u, double v) const;
  // Offset along a row of pixels, for who asks for all of them.
  struct Row {
    std::array<double, 3> along_u, along_v;  // of 1, x, x^2
    double middle, scale;                    // x = (u - middle) * scale

    double OffsetU(double u) const { return At(along_u, (u - middle) * scale); }
    double OffsetV(double u) const { return At(along_v, (u - middle) * scale); }

   private:
    static double At(const std::array<double, 3>& of, double x) { return of[0] + x * (of[1] + x * of[2]); }
  };
  Row RowAt(double v) const;
  // Of Offset over the image, root mean square and largest; pixels of the model's image.
  double MeanOffset() const;
  double LargestOffset() const;

  Coefficients coefficients = Coefficients::Zero();

 private:
  int width_, height_;
};

}  // namespace phi
