// Union-find over bands of rows, which are labelled in parallel and then joined along their seams. The root of a set is
// its smallest pixel index, whatever the bands.
#include "phi/inference/image_regions.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/box_sums.h"

namespace phi {
namespace {

constexpr int kMaxStep = 18;   // between neighbours of one region, in ninths of a grey level (3 x 3 sums)
constexpr int kBandRows = 64;  // labelled by one thread

class RegionLabelling {
 public:
  explicit RegionLabelling(const GrayImage& image)
      : width_(image.width()),
        height_(image.height()),
        num_bands_((height_ + kBandRows - 1) / kBandRows),
        sums_(SumBoxes3x3(image.view())),
        regions_(width_, height_),
        labels_(regions_.data()) {}

  ImageRegions Run() {
    ForBands([&](int band) { LabelBand(band); });
    JoinBands();
    ForBands([&](int band) { ResolveBand(band); });
    const std::int32_t num_regions = NumberRoots();
    ForBands([&](int band) { NumberBand(band); });
    return {std::move(regions_), num_regions};
  }

 private:
  template <class Function>
  void ForBands(const Function& function) const {
    tbb::parallel_for(0, num_bands_, function);
  }

  std::int32_t BandBegin(int band) const { return band * kBandRows * width_; }
  std::int32_t BandEnd(int band) const { return std::min((band + 1) * kBandRows, height_) * width_; }

  bool Alike(std::int32_t i, std::int32_t j) const {
    return std::abs(sums_.data()[i] - sums_.data()[j]) <= kMaxStep;
  }

  // Root of a pixel's set. Path halving.
  std::int32_t Find(std::int32_t i) {
    while (labels_[i] != i) i = labels_[i] = labels_[labels_[i]];
    return i;
  }

  // The root that is no longer one, or -1.
  std::int32_t Join(std::int32_t i, std::int32_t j) {
    const std::int32_t a = Find(i), b = Find(j);
    if (a == b) return -1;
    labels_[std::max(a, b)] = std::min(a, b);
    return std::max(a, b);
  }

  // Every pixel gets its root within the band.
  void LabelBand(int band) {
    const std::int32_t begin = BandBegin(band), end = BandEnd(band);
    for (std::int32_t row = begin; row < end; row += width_) {
      bool corner = false;  // the pixel to the left is like the one above it
      for (std::int32_t i = row; i < row + width_; ++i) {
        const bool left = i > row && Alike(i, i - 1);
        const bool above = row > begin && Alike(i, i - width_);
        labels_[i] = left ? labels_[i - 1] : above ? labels_[i - width_] : i;
        // Where all four pixels of the square are alike in a ring, the left one and the one above are joined already.
        if (left && above && !(corner && Alike(i - width_, i - width_ - 1))) Join(i, i - width_);
        corner = above;
      }
    }
    for (std::int32_t i = begin; i < end; ++i) labels_[i] = labels_[labels_[i]];  // roots come first
  }

  // Afterwards the root of a pixel is its band root's label.
  void JoinBands() {
    std::vector<std::int32_t> joined;
    for (int band = 1; band < num_bands_; ++band) {
      const std::int32_t row = BandBegin(band);
      for (std::int32_t i = row; i < row + width_; ++i) {
        if (!Alike(i, i - width_)) continue;
        const std::int32_t former_root = Join(i, i - width_);
        if (former_root >= 0) joined.push_back(former_root);
      }
    }
    for (const std::int32_t i : joined) labels_[i] = Find(i);
  }

  // Writes no label that another band reads: those of former band roots are right already.
  void ResolveBand(int band) {
    for (std::int32_t i = BandBegin(band); i < BandEnd(band); ++i) {
      const std::int32_t root = labels_[labels_[i]];
      if (labels_[i] != root) labels_[i] = root;
    }
  }

  // Roots take the number n of their region as ~n, so that they still differ from pixel indices.
  std::int32_t NumberRoots() {
    std::vector<std::int32_t> first(num_bands_ + 1, 0);
    ForBands([&](int band) {
      for (std::int32_t i = BandBegin(band); i < BandEnd(band); ++i) first[band + 1] += labels_[i] == i;
    });
    for (int band = 0; band < num_bands_; ++band) first[band + 1] += first[band];
    ForBands([&](int band) {
      std::int32_t number = first[band];
      for (std::int32_t i = BandBegin(band); i < BandEnd(band); ++i) {
        if (labels_[i] == i) labels_[i] = ~number++;
      }
    });
    return first.back();
  }

  // Writes pixels that are no roots; other bands read only roots.
  void NumberBand(int band) {
    for (std::int32_t i = BandBegin(band); i < BandEnd(band); ++i) {
      if (labels_[i] >= 0) labels_[i] = labels_[labels_[i]];
    }
  }

  const int width_, height_, num_bands_;
  const Array2D<std::uint16_t> sums_;
  Array2D<std::int32_t> regions_;
  std::int32_t* labels_;  // regions_' pixels; while at work, each one's parent in the forest
};

}  // namespace

ImageRegions FindRegions(const GrayImage& image) {
  ImageRegions regions = RegionLabelling(image).Run();
  tbb::parallel_for(0, image.height(), [&](int y) {
    for (int x = 0; x < image.width(); ++x) regions.region(x, y) = ~regions.region(x, y);
  });
  return regions;
}

}  // namespace phi
