// Whether the source images show a spot of the reference image as bright where a plane would put it. On an even wall windows tell
// no depth; but where a wrong plane lands on a bookcase, the brightness is another.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "phi/backend.h"
#include "phi/geometry/device_camera.h"
#include "phi/inference/anchor_cells.h"
#include "phi/inference/box_mean.h"
#include "phi/inference/image_plane.h"
#include "phi/inference/relative_exposure.h"
#include "phi/inference/shown_point.h"
#include "phi/inference/spot.h"

namespace phi {

// What a plane foretells of the directions that spots lie in, counted over spots and source views. From where the source camera
// stands another part of the plane lies in that direction, which the reference image shows as well.
struct Foretold {
  std::size_t num_unlike = 0;  // that part and what is around it are clearly unlike the spot
  std::size_t num_seen = 0;    // of these, the source shows something unlike the spot
};

// What the source views show of a spot infinitely far away, and on a plane.
struct FarSpot {
  double unlike = 0;               // share of the views that tell, and show another brightness there; 0: none tells
  bool is_seen = false;            // one shows that place
  bool is_shown = false;           // one shows the spot's brightness there
  bool is_seen_on_plane = false;   // one that shows the place infinitely far away shows the plane's as well
  bool is_shown_on_plane = false;  // and the spot's brightness there
};

// What a source shows of a spot at some inverse depth.
struct ShadeOfSpot {
  float change;  // grey levels by which the reference is brighter, exposures made alike
  float slope;   // of the change, with the inverse depth
};

class SpotViews {
 public:
  // `exposures`: of the sources. `input` outlives this.
  SpotViews(const InferenceInput& input, std::span<const RelativeExposure> exposures);

  // Of the source views that show the spot's point at inverse depth w, the share with another brightness there; 0: none shows
  // it. A view that measured something else at the place tells nothing: the point is hidden there, or the measurement is wrong.
  // 1 for less than 0, which is no depth.
  double Unlike(const Spot& spot, double w) const;

  // w > 0: of the spot's point. A view that shows the spot alike in neither place tells nothing: it was exposed otherwise, in a way
  // that no gain explains. One that does not show the point, or measured something else there, tells of infinity alone.
  FarSpot LookFar(const Spot& spot, double w) const;

  // `plane`: of the reference image. Where something was measured, by a view in a spot's direction or by the reference before the
  // plane, it hides what the plane foretells.
  Foretold CountForetold(std::span<const Spot> spots, const ImagePlane& plane) const;

  // Of cells behind a plane, mirrored at it.
  struct Mirrored {
    std::size_t num_measured = 0;   // a view, the reference among them, measured something there
    std::size_t num_seen_past = 0;  // none did, and one measured what lies behind
    double num_by_chance = 0;       // something is measured where nothing should be: somewhat nearer, or farther
  };
  Mirrored CountMirrored(std::span<const AnchorCell> behind, const ImagePlane& plane) const;

  std::size_t NumSources() const { return sources_.size(); }

  // What the reference shows of the spot; nullopt: too near the image's side, or so bright that some of it may be cut off at white.
  std::optional<BoxMean> MeanHere(const Spot& spot) const;
  // Its value as it would be without the lens's falloff and the photo's tones; grey levels.
  std::optional<float> BrightnessHere(const Spot& spot) const;
  // What a source shows of it at inverse depth w, against `here`; nullopt, too: it measured something else at the place.
  std::optional<ShadeOfSpot> ShadeIn(std::size_t source, const Spot& spot, const BoxMean& here, float w) const;

 private:
  struct Source {
    RelativeView view;
    Eigen::Vector3d center;  // of its camera, an image point of the reference: CalibrationMatrix times (x, y, z), world units
    const GrayImage* image;
    MeasuredDepthsView depths;
    PhotoFrame frame;
    RelativeExposure exposure;
  };

  // Where the source shows the spot's point of inverse depth w. nullopt: behind its camera, beside its image, or it measured something
  // there that is not that point, by more than `gap`.
  static std::optional<ShownPoint> Find(const Source& source, const Spot& spot, float w, float gap);
  // Whether the spot and the place where the source shows it differ in brightness.
  bool IsUnlikeThere(const Source& source, const Spot& spot, const ShownPoint& shown) const;
  // Whether the place of `plane` that lies in the spot's direction from the source looks clearly unlike the spot.
  bool ForetellsUnlike(const Source& source, const Spot& spot, const ImagePlane& plane) const;
  bool IsUnlikeAround(const Spot& spot, int x, int y) const;
  BrightSpot InReference(int x, int y) const { return frame_.Spot(x, y, static_cast<float>((*reference_)(x, y))); }

  // `point`: an image point of the reference times its depth, which may lie behind the camera.
  void AskMeasured(const Eigen::Vector3d& point, Mirrored* mirrored) const;

  // The depth that the reference measured; 0: none, or it is unknown.
  float MeasuredHere(int x, int y) const {
    return measured_ != nullptr && IsMeasured(measured_->states(x, y)) ? measured_->planes(x, y).depth : 0.0f;
  }
  // Whether that is before `depth`.
  bool IsHidden(int x, int y, float depth) const;

  Eigen::Matrix3d calibration_;  // of the reference
  const GrayImage* reference_;
  const MeasurementMap* measured_;  // of the reference; null: unknown
  PhotoFrame frame_;
  RelativeExposure own_exposure_;  // of the reference against itself
  std::vector<Source> sources_;
};

}  // namespace phi
