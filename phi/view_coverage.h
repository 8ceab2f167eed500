// The robust choice of source views: those that together show the most of the reference image well.
//
// A view shows a point well where the rays to both centres meet at a useful angle and the surface has about the same
// scale in both images. Two views from one direction are one witness. The image is divided into cells that count alike
// however many points they have, and each further view of a point gains less: so views come first that show what no other
// one does. All is angles and shares of the image, so the choice does not depend on the resolution.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "phi/view_samples.h"

namespace phi {

// How well a pair matches and tells depth, [0, 1]. angle: at the point, radians. Half at 4 degrees and at 25, best at
// about 10: narrower ones tell depth poorly, wider ones distort the window. scale: of these angles.
float UsefulAngle(float angle, float scale = 1);

// A greedy choice, view by view. Does not depend on the samples' order; ties go to the smaller image id.
class ViewCoverage {
 public:
  // samples: as ViewSampler makes them, those of a point one after the other. image_ids: by view. scale: of the angles
  // and of the least gain.
  ViewCoverage(std::span<const ViewSample> samples, const std::vector<std::uint32_t>& image_ids,
               float scale = 1);

  // Takes the one of `candidates` (views) that gains most, until there are `max_size` or none gains anything more.
  // Returns those taken, best first. What was taken before counts as shown.
  std::vector<int> Take(const std::vector<int>& candidates, std::size_t max_size);

 private:
  struct Witness {
    int candidate = 0;  // index into views_
    float worth = 0;    // of the pair at this point, [0, 1]
    float novelty = 1;  // share of it that no view that was taken shows already
    Eigen::Vector3f to_source;
  };
  struct Point {
    std::size_t begin = 0, end = 0;  // of its witnesses
    float weight = 0;
    float shown = 0;  // worth times novelty of the views that were taken
  };

  std::vector<std::int64_t> Gains() const;
  void Add(int candidate);

  float scale_;
  std::vector<int> views_;  // that samples name, by image id
  std::vector<Witness> witnesses_;
  std::vector<Point> points_;
};

}  // namespace phi
