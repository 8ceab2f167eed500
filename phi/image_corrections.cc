#include "phi/image_corrections.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <Eigen/LU>

#include "phi/base/median.h"
#include "phi/geometry/triangulation_step.h"

namespace phi {
namespace {

// Below this matching hardly notices, pixels of the working images.
constexpr double kNoticed = 0.25;
// A hundredth of the image's longer side: no pose that a stereo can work with is so far off.
constexpr double kMostOfSide = 0.01;
// No keypoint lies more exactly, pixels.
constexpr double kLeastNoise = 0.01;
// What an error of so many deviations counts is halved.
constexpr double kHalfWeightAt = 2;
// Of a step of the points (TriangulationStep).
constexpr double kPointDamping = 1e-6;
// The median length of a plane vector whose components have deviation 1.
constexpr double kMedianLength = 1.17741;
// What is first taken for the corrections' deviation, pixels: more than they are.
constexpr double kFirstDeviation = 1;
constexpr int kNumFirstSteps = 10;
// Whether poses fit so many views tell, evenly spread: of 10,000 all would take a minute of a core.
constexpr int kMostAsked = 400;
// The corrections and the points that follow them, in turns, until no correction moves by more than kSettled pixels.
constexpr int kMostRounds = 40;
constexpr double kSettled = 0.01;
// Coefficients are rounded, so that machines whose last bits differ agree on a result's key; pixels.
constexpr double kCoefficientStep = 1.0 / 1024;

constexpr int kNumTerms = ImageCorrection::kNumTerms;
constexpr std::array<int, kNumTerms> kDegreeOf = {0, 1, 2, 1, 2, 2};
constexpr int kNumDegrees = 3;

using TermMatrix = Eigen::Matrix<double, kNumTerms, kNumTerms>;

// Cauchy's, of an error whose components have such a standard deviation.
double RobustWeight(double error, double deviation) {
  const double off = error / (kHalfWeightAt * deviation);
  return 1 / ((1 + off * off) * deviation * deviation);
}

// A point takes up some of its observations' errors: this share of their variance is left, of a track of so many views. It has
// three coordinates, two of each observation.
double VisibleShare(std::size_t track_length) {
  const auto length = static_cast<double>(track_length);
  return std::max(length - 1.5, 0.5) / length;
}

// The corrections' variance by degree, that of all images: by it those of clean scenes shrink to nothing.
struct Variances {
  std::array<double, kNumDegrees> of_degree{};

  Eigen::Matrix<double, kNumTerms, 1> Precisions() const {
    Eigen::Matrix<double, kNumTerms, 1> precisions;
    for (int k = 0; k < kNumTerms; ++k) precisions[k] = 1 / of_degree[kDegreeOf[k]];
    return precisions;
  }
};

struct ViewFit {
  ImageCorrection correction;
  bool has_points = false;
  double noise = 1;  // standard deviation of an observation along each axis, pixels
  Eigen::Matrix<double, kNumTerms, 1> variances =
      Eigen::Matrix<double, kNumTerms, 1>::Zero();  // of a coefficient
};

class Adjustment {
 public:
  Adjustment(const std::vector<SceneView>& views, const SparseScene& scene)
      : views_(views), scene_(scene), visible_(scene) {
    variances_.of_degree.fill(kFirstDeviation * kFirstDeviation);
    points_.reserve(scene.num_points());
    for (std::size_t i = 0; i < scene.num_points(); ++i) points_.push_back(scene.point(i));
    for (int view = 0; view < scene.num_views(); ++view) {
      fits_.push_back({.correction = ImageCorrection(scene.model_pinhole(view))});
    }
  }

  // Of every `stride`th view, to the points where they are.
  void FitFirst(int stride) {
    std::vector<int> which;
    for (int view = 0; view < static_cast<int>(fits_.size()); view += stride) which.push_back(view);
    for (int step = 0; step < kNumFirstSteps; ++step) FitViews(which);
  }

  // Points go where their moved observations meet, corrections follow, and so on.
  void Settle() {
    std::vector<int> all(fits_.size());
    std::iota(all.begin(), all.end(), 0);
    for (int round = 0; round < kMostRounds; ++round) {
      MovePoints();
      if (FitViews(all) < kSettled) return;
    }
  }

  const std::vector<ViewFit>& fits() const { return fits_; }

 private:
  struct Residual {
    ImageCorrection::Terms terms;
    Eigen::Vector2d error;  // observed less projected, pixels
    double share;           // VisibleShare
  };

  std::optional<Residual> ResidualOf(int view, std::size_t point) const {
    const std::span<const PointObservation> track = scene_.track(point);
    if (track.size() < 2) return std::nullopt;
    const auto seen = std::find_if(track.begin(), track.end(), [&](const auto& o) { return o.view == view; });
    const Eigen::Vector3d in_camera = views_[view].camera.pose * points_[point];
    if (!(in_camera.z() > 0)) return std::nullopt;
    const Pinhole& k = scene_.model_pinhole(view);
    const Eigen::Vector2d projected = k.Project(in_camera),
                          error = Eigen::Vector2d(seen->u, seen->v) - projected;
    // Beyond the image by its size: a point beside the camera, or no number.
    if (!(error.norm() < k.width + k.height)) return std::nullopt;
    return Residual{fits_[view].correction.TermsAt(projected.x(), projected.y()), error,
                    VisibleShare(track.size())};
  }

  // One step. Returns the largest change of a correction, root mean square over its image.
  double FitViews(const std::vector<int>& which) {
    std::vector<double> changes(which.size(), 0.0);
    tbb::parallel_for(std::size_t{0}, which.size(), [&](std::size_t i) {
      ImageCorrection change = fits_[which[i]].correction;
      FitView(which[i]);
      change.coefficients -= fits_[which[i]].correction.coefficients;
      changes[i] = change.MeanOffset();
    });
    UpdateVariances();
    return *std::max_element(changes.begin(), changes.end());
  }

  // Least squares, robust, with the corrections' variances as what is known beforehand.
  void FitView(int view) {
    ViewFit& fit = fits_[view];
    std::vector<Residual> residuals;
    std::vector<double> lengths;
    for (const std::uint32_t point : visible_[view]) {
      const std::optional<Residual> residual = ResidualOf(view, point);
      if (!residual) continue;
      residuals.push_back(*residual);
      lengths.push_back((residual->error - fit.correction.coefficients.transpose() * residual->terms).norm() /
                        std::sqrt(residual->share));
    }
    fit.has_points = !residuals.empty();
    if (!fit.has_points) return;
    std::vector<double> sorted = lengths;
    fit.noise = std::max(Median(&sorted) / kMedianLength, kLeastNoise);
    TermMatrix normal = variances_.Precisions().asDiagonal();
    ImageCorrection::Coefficients right = ImageCorrection::Coefficients::Zero();
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const double weight = RobustWeight(lengths[i], fit.noise);
      normal += weight * residuals[i].terms * residuals[i].terms.transpose();
      right += weight * residuals[i].terms * residuals[i].error.transpose();
    }
    const TermMatrix covariance = normal.inverse();
    fit.correction.coefficients = covariance * right;
    fit.variances = covariance.diagonal();
  }

  // A step of expectation maximization.
  void UpdateVariances() {
    std::array<double, kNumDegrees> sums{}, counts{};
    for (const ViewFit& fit : fits_) {
      if (!fit.has_points) continue;
      for (int k = 0; k < kNumTerms; ++k) {
        sums[kDegreeOf[k]] += fit.correction.coefficients.row(k).squaredNorm() + 2 * fit.variances[k];
        counts[kDegreeOf[k]] += 2;
      }
    }
    for (int degree = 0; degree < kNumDegrees; ++degree) {
      if (counts[degree] > 0) variances_.of_degree[degree] = std::max(sums[degree] / counts[degree], 1e-8);
    }
  }

  void MovePoints() {
    tbb::parallel_for(std::size_t{0}, points_.size(), [&](std::size_t point) { MovePoint(point); });
  }

  // A Gauss-Newton step towards where the moved observations' rays meet.
  void MovePoint(std::size_t point) {
    const std::span<const PointObservation> track = scene_.track(point);
    if (track.size() < 2) return;
    TriangulationStep towards;
    for (const PointObservation& seen : track) {
      const Camera camera{scene_.model_pinhole(seen.view), views_[seen.view].camera.pose};
      const Eigen::Vector3d p = camera.pose * points_[point];
      if (!(p.z() > 0)) return;
      const Eigen::Vector2d projected = camera.pinhole.Project(p);
      const ViewFit& fit = fits_[seen.view];
      const Eigen::Vector2d error =
          Eigen::Vector2d(seen.u, seen.v) - fit.correction.Offset(projected.x(), projected.y()) - projected;
      towards.Add(camera, p, error, RobustWeight(error.norm(), fit.noise));
    }
    const Eigen::Vector3d step = towards.Solve(kPointDamping);
    if (!step.allFinite()) return;
    const Eigen::Vector3d moved = points_[point] + step;
    for (const PointObservation& seen : track) {
      if (!((views_[seen.view].camera.pose * moved).z() > 0)) return;
    }
    points_[point] = moved;
  }

  const std::vector<SceneView>& views_;
  const SparseScene& scene_;
  const VisiblePoints visible_;
  Variances variances_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<ViewFit> fits_;
};

// Of what all corrections move, root mean square.
struct MeanMove {
  double pixels = 0;   // of the working images
  double of_side = 0;  // of the longer side
};

MeanMove MeanMoveOf(const std::vector<ViewFit>& fits, const std::vector<SceneView>& views) {
  MeanMove sum;
  int count = 0;
  for (std::size_t view = 0; view < fits.size(); ++view) {
    if (!fits[view].has_points) continue;
    const ImageCorrection& correction = fits[view].correction;
    const double of_side =
        correction.MeanOffset() / std::max(correction.model_width(), correction.model_height());
    const Pinhole& working = views[view].camera.pinhole;
    const double pixels = of_side * std::max(working.width, working.height);
    sum.pixels += pixels * pixels;
    sum.of_side += of_side * of_side;
    ++count;
  }
  if (count == 0) return {};
  return {std::sqrt(sum.pixels / count), std::sqrt(sum.of_side / count)};
}

}  // namespace

ImageCorrections FindImageCorrections(const std::vector<SceneView>& views, const SparseScene& scene,
                                      const Method& method) {
  ImageCorrections corrections;
  if (method.FormulasOf(Rule::kImageCorrections) == Formulas::kPaper) return corrections;
  if (scene.num_points() == 0) return corrections;
  Adjustment adjustment(views, scene);
  adjustment.FitFirst((scene.num_views() + kMostAsked - 1) / kMostAsked);
  const MeanMove visible = MeanMoveOf(adjustment.fits(), views);
  corrections.mean_offset = visible.pixels;
  corrections.points_are_others = visible.of_side > kMostOfSide;
  const bool is_noticed = visible.pixels > kNoticed * method.rules.Factor(Rule::kImageCorrections);
  if (!is_noticed || corrections.points_are_others) return corrections;
  if (scene.num_views() > kMostAsked) adjustment.FitFirst(1);
  adjustment.Settle();
  for (const ViewFit& fit : adjustment.fits()) {
    corrections.of_view.push_back(fit.correction);
    auto& coefficients = corrections.of_view.back().coefficients;
    coefficients = (coefficients / kCoefficientStep).array().round().matrix() * kCoefficientStep;
  }
  return corrections;
}

}  // namespace phi
