#include "phi/inference/photo_tones.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <tbb/parallel_for.h>
#include <Eigen/Cholesky>

#include "phi/base/median.h"
#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

constexpr int kTerms = ToneField::kNumTerms;
constexpr int kOwnUnknowns = 2 + kTerms;  // of a source: gain, exponent, field
constexpr int kUnknowns = kTerms + kOwnUnknowns;
constexpr int kRounds = 6;
// Residuals of the logarithm of brightness: the least median, so many medians weigh half, and none is more exact than this.
constexpr float kLeastMedian = 0.01f, kFarMedians = 3, kLeastError = 0.02f;
constexpr float kMiddleGrey = 100;  // at which an exponent changes nothing; grey levels
constexpr int kTableSide = 33;
// Of so many parts of the reference's width and height every fourth is left out, to be foretold.
constexpr int kParts = 8, kHeldOut = 4;
// Of what is unexplained without tones: where more is left, they are gloss and mistaken spots.
constexpr float kMaxLeft = 0.9f;
constexpr double kGainPrior = 1e-3;  // so that all can be solved for

bool IsHeldOut(const BrightSpot& reference) {
  const auto part = [](float share) { return std::clamp(static_cast<int>(share * kParts), 0, kParts - 1); };
  return (part(reference.u) + 2 * part(reference.v)) % kHeldOut == 0;
}

// What a solution is fitted to: all spots, or those of the parts that are not held out.
enum class Fitted : bool { kAll, kNotHeldOut };

// Sums are written out, here and in ToneField: Eigen's go in an order that depends on the size of the processor's cache and on its
// instructions.

// A spot's row of the equation: what is multiplied by the unknowns, what is unexplained, and 1.
constexpr int kUnexplained = kUnknowns, kOne = kUnknowns + 1, kColumns = kUnknowns + 2;
using Row = std::array<float, kColumns>;

// The weighted sum of the rows' products with themselves, its upper right half.
using Products = std::array<std::array<double, kColumns>, kColumns>;

// Rows and their weights, whose products are added together: the sums are in memory, and what is added to them is not.
struct RowBatch {
  static constexpr std::size_t kSize = 4;
  std::size_t size = 0;
  std::array<const Row*, kSize> rows = {};
  std::array<double, kSize> weights = {};
};

// Each sum takes the rows in their order. What the batch lacks has no weight.
PHI_WIDE_VECTORS void AddProducts(const RowBatch& batch, Products* sums) {
  constexpr int kTogether = 4;  // one vector's, so that each row of sums is whole ones
  static_assert(RowBatch::kSize == 4);
  double values[RowBatch::kSize][kColumns] = {};
  for (std::size_t r = 0; r < batch.size; ++r) {
    for (int k = 0; k < kColumns; ++k) values[r][k] = (*batch.rows[r])[k];
  }
  for (int i = 0; i < kColumns; ++i) {
    double weighted[RowBatch::kSize] = {};
    for (std::size_t r = 0; r < batch.size; ++r) weighted[r] = batch.weights[r] * values[r][i];
    double* of_row = (*sums)[i].data();
    for (int k = i / kTogether * kTogether; k < kColumns; ++k) {
      double sum = of_row[k] + weighted[0] * values[0][k];
      sum += weighted[1] * values[1][k];
      sum += weighted[2] * values[2][k];
      of_row[k] = sum + weighted[3] * values[3][k];
    }
  }
}

// One source's spots: terms of the reference's field, and of the source's own unknowns.
class SourceRows {
 public:
  explicit SourceRows(const SharedTones& tones)
      : rows_(tones.pairs.size()), is_held_out_(tones.pairs.size()) {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const auto& [reference, source] = tones.pairs[i];
      Eigen::Map<Eigen::Matrix<float, kColumns, 1>>(rows_[i].data()) << -ToneField::TermsAt(reference.u, reference.v), 1,
          std::log(source.brightness / kMiddleGrey), ToneField::TermsAt(source.u, source.v), tones.unexplained[i], 1;
      is_held_out_[i] = IsHeldOut(reference);
    }
  }

  struct Normal {
    Eigen::Matrix<double, kUnknowns, kUnknowns> matrix;
    Eigen::Matrix<double, kUnknowns, 1> right;
    double weight;  // of all rows
  };
  Normal Linearize(const Eigen::VectorXf& solution, Fitted fitted) const {
    const std::vector<float> residuals = Residuals(solution);
    const float median = std::max(MedianSize(residuals, fitted), kLeastMedian), error = std::max(median, kLeastError);
    Products sums = {};
    RowBatch batch;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!Takes(fitted, i)) continue;
      const float off = residuals[i] / (kFarMedians * median);
      batch.rows[batch.size] = &rows_[i];
      batch.weights[batch.size++] = 1 / ((1 + off * off) * error * error);
      if (batch.size < RowBatch::kSize) continue;
      AddProducts(batch, &sums);
      batch.size = 0;
    }
    AddProducts(batch, &sums);
    Normal normal;
    for (int i = 0; i < kUnknowns; ++i) {
      for (int k = i; k < kUnknowns; ++k) normal.matrix(i, k) = normal.matrix(k, i) = sums[i][k];
      normal.right[i] = sums[i][kUnexplained];
    }
    normal.weight = sums[kOne][kOne];
    return normal;
  }

  // Adds what the solution leaves of the rows that are held out, and what they are without tones.
  void Foretell(const Eigen::VectorXf& solution, std::vector<float>* with, std::vector<float>* without) const {
    const std::vector<float> residuals = Residuals(solution);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (Takes(Fitted::kNotHeldOut, i)) continue;
      with->push_back(std::abs(residuals[i]));
      without->push_back(std::abs(rows_[i][kUnexplained]));
    }
  }

 private:
  std::vector<float> Residuals(const Eigen::VectorXf& solution) const {
    std::vector<float> residuals;
    residuals.reserve(rows_.size());
    for (const Row& row : rows_) {
      float left = row[kUnexplained];
      for (int k = 0; k < kUnknowns; ++k) left -= row[k] * solution[k];
      residuals.push_back(left);
    }
    return residuals;
  }

  bool Takes(Fitted fitted, std::size_t row) const { return fitted == Fitted::kAll || !is_held_out_[row]; }

  float MedianSize(const std::vector<float>& residuals, Fitted fitted) const {
    std::vector<float> sizes;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (Takes(fitted, i)) sizes.push_back(std::abs(residuals[i]));
    }
    return sizes.empty() ? 0 : Median(&sizes);
  }

  std::vector<Row> rows_;
  std::vector<bool> is_held_out_;
};

// All sources' unknowns: the reference's field, then each source's own.
class ToneFit {
 public:
  ToneFit(std::span<const SharedTones> sources, double prior) : prior_(prior) {
    for (const SharedTones& source : sources) rows_.emplace_back(source);
  }

  void Solve(Fitted fitted) {
    solution_.setZero(First(rows_.size()));
    for (int round = 0; round < kRounds; ++round) Step(fitted);
  }

  Eigen::VectorXf Of(std::size_t source) const {
    Eigen::VectorXf of(kUnknowns);
    of << solution_.head<kTerms>().cast<float>(), solution_.segment<kOwnUnknowns>(First(source)).cast<float>();
    return of;
  }

  // Solved for what is not held out.
  bool ForetellsBetter() const {
    std::vector<float> with, without;
    for (std::size_t j = 0; j < rows_.size(); ++j) rows_[j].Foretell(Of(j), &with, &without);
    return !with.empty() && Median(&with) < kMaxLeft * Median(&without);
  }

 private:
  static Eigen::Index First(std::size_t source) { return kTerms + kOwnUnknowns * static_cast<Eigen::Index>(source); }

  void Step(Fitted fitted) {
    std::vector<SourceRows::Normal> normals(rows_.size());
    tbb::parallel_for(std::size_t{0}, rows_.size(), [&](std::size_t j) { normals[j] = rows_[j].Linearize(Of(j), fitted); });
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(solution_.size(), solution_.size());
    Eigen::VectorXd right = Eigen::VectorXd::Zero(solution_.size());
    const Eigen::VectorXd orders = ToneField::OrderOfTerms().cast<double>();
    for (std::size_t j = 0; j < rows_.size(); ++j) {
      const auto& [of_source, right_of_source, weight] = normals[j];
      const Eigen::Index first = First(j);
      matrix.topLeftCorner<kTerms, kTerms>() += of_source.topLeftCorner<kTerms, kTerms>();
      matrix.block<kTerms, kOwnUnknowns>(0, first) = of_source.topRightCorner<kTerms, kOwnUnknowns>();
      matrix.block<kOwnUnknowns, kTerms>(first, 0) = of_source.bottomLeftCorner<kOwnUnknowns, kTerms>();
      matrix.block<kOwnUnknowns, kOwnUnknowns>(first, first) = of_source.bottomRightCorner<kOwnUnknowns, kOwnUnknowns>();
      right.head<kTerms>() += right_of_source.head<kTerms>();
      right.segment<kOwnUnknowns>(first) = right_of_source.tail<kOwnUnknowns>();
      const double prior = prior_ * weight;
      matrix.diagonal().head<kTerms>() += prior / static_cast<double>(rows_.size()) * orders;
      matrix(first, first) += kGainPrior;
      matrix(first + 1, first + 1) += prior;
      matrix.diagonal().segment<kTerms>(first + 2) += prior * orders;
    }
    solution_ = matrix.ldlt().solve(right);
  }

  double prior_;
  std::vector<SourceRows> rows_;
  Eigen::VectorXd solution_;
};

}  // namespace

ToneField::Terms ToneField::TermsAt(float u, float v) {
  std::array<float, kOrder + 1> along, down;  // of so many half waves
  for (std::size_t k = 0; k <= kOrder; ++k) {
    const float angle = std::numbers::pi_v<float> * static_cast<float>(k);
    along[k] = std::cos(angle * u);
    down[k] = std::cos(angle * v);
  }
  Terms terms;
  int i = 0;
  for (std::size_t k = 0; k <= kOrder; ++k) {
    for (std::size_t l = k == 0 ? 1 : 0; k + l <= kOrder; ++l) terms[i++] = along[k] * down[l];
  }
  return terms;
}

ToneField::Terms ToneField::OrderOfTerms() {
  Terms orders;
  int i = 0;
  for (int k = 0; k <= kOrder; ++k) {
    for (int l = k == 0 ? 1 : 0; k + l <= kOrder; ++l) orders[i++] = static_cast<float>(k + l);
  }
  return orders;
}

ToneField::ToneField(const Terms& factors) : table_(kTableSide, kTableSide) {
  const auto share = [](int i) { return static_cast<float>(i) / (kTableSide - 1); };
  for (int y = 0; y < kTableSide; ++y) {
    for (int x = 0; x < kTableSide; ++x) {
      const Terms terms = TermsAt(share(x), share(y));
      float sum = 0;
      for (int i = 0; i < kNumTerms; ++i) sum += factors[i] * terms[i];
      table_(x, y) = std::exp(sum);
    }
  }
}

float ToneField::At(float u, float v) const {
  const float x = std::clamp(u, 0.0f, 1.0f) * (kTableSide - 1), y = std::clamp(v, 0.0f, 1.0f) * (kTableSide - 1);
  const int left = std::min(static_cast<int>(x), kTableSide - 2), top = std::min(static_cast<int>(y), kTableSide - 2);
  const float dx = x - static_cast<float>(left), dy = y - static_cast<float>(top);
  const float above = std::lerp(table_(left, top), table_(left + 1, top), dx);
  return std::lerp(above, std::lerp(table_(left, top + 1), table_(left + 1, top + 1), dx), dy);
}

std::vector<std::shared_ptr<const PhotoTones>> PhotoTones::Fit(std::span<const SharedTones> sources, double prior) {
  ToneFit fit(sources, prior);
  fit.Solve(Fitted::kNotHeldOut);
  if (!fit.ForetellsBetter()) return {};
  fit.Solve(Fitted::kAll);
  const auto reference = std::make_shared<const ToneField>(ToneField::Terms(fit.Of(0).head<kTerms>()));
  std::vector<std::shared_ptr<const PhotoTones>> tones;
  for (std::size_t j = 0; j < sources.size(); ++j) {
    const Eigen::VectorXf of = fit.Of(j);
    auto source = std::make_shared<const ToneField>(ToneField::Terms(of.tail<kTerms>()));
    tones.push_back(std::shared_ptr<const PhotoTones>(new PhotoTones(reference, std::move(source), of[kTerms], of[kTerms + 1])));
  }
  return tones;
}

PhotoTones::PhotoTones(std::shared_ptr<const ToneField> reference, std::shared_ptr<const ToneField> source, float gain, float exponent)
    : reference_(std::move(reference)), source_(std::move(source)), exponent_(exponent) {
  for (int level = 0; level < 256; ++level) {
    // Black has no logarithm.
    factors_.push_back(std::exp(gain + exponent * std::log(static_cast<float>(std::max(level, 1)) / kMiddleGrey)));
  }
}

std::shared_ptr<const PhotoTones> PhotoTones::OfReference() const {
  return std::shared_ptr<const PhotoTones>(new PhotoTones(reference_, reference_, 0, 0));
}

float PhotoTones::Factor(const BrightSpot& reference, const BrightSpot& source) const {
  const auto level = static_cast<std::size_t>(std::clamp(source.brightness + 0.5f, 0.0f, 255.0f));
  return factors_[level] * source_->At(source.u, source.v) / reference_->At(reference.u, reference.v);
}

}  // namespace phi
