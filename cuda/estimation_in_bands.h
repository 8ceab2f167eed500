// The estimation of an image whose pixel state does not fit on the device: the state is in page-locked host memory, and
// each half-pass of the checkerboard goes over bands of rows. A band comes with the rows around it that propagation reads;
// those change in the other half-pass only, so the result is that of the whole image to the byte.
#pragma once

#include "cuda/estimation_kernels.h"
#include "cuda/scratch.h"

namespace phi::gpu {

class EstimationInBands {
 public:
  // launch: everything but state and rows. band_rows: a multiple of kTileSide. The device buffers of `scratch` take a band,
  // its host buffers the whole image.
  EstimationInBands(const EstimationLaunch& launch, int band_rows, Scratch* scratch, const Task& task);

  // found: null, or what the part before found; `coarse` has its shift, and is completed with a band's rows of it.
  void Initialize(CoarseHypotheses coarse, const PlaneMap* found);
  void HalfPass(int iteration, int colour);

 private:
  // Rows from `first` to before `end`; with the rows that propagation reads, from `first_read` to before `end_read`.
  struct Band {
    int first, end, first_read, end_read;
  };
  enum class Direction { kToDevice, kToHost };

  template <class Function>
  void ForEachBand(const Function& function);
  // The launch of one band: views that take the whole image's coordinates, and hold the band's rows alone.
  EstimationLaunch Bind(const Band& band) const;
  void CopyNeighbourRows(const Band& band, int first, int end, Direction direction);
  // The rows of `coarse` that cover the band, in the whole map's coordinates.
  ArrayView2D<const PlaneHypothesis> UploadCoarse(const PlaneMap& coarse, int shift, const Band& band);

  const EstimationLaunch launch_;
  const int width_, height_, band_rows_;
  Scratch* scratch_;
  const Task& task_;
};

}  // namespace phi::gpu
