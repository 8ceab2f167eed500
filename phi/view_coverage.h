// The robust choice of source views: those that together show the most of the reference image well.
//
// A view shows a point well where the rays to both centres meet at a useful angle and the surface has about the same
// scale in both images. Two views from one direction are one witness. The image is divided into cells that count alike
// however many points they have, and each further view of a point gains less: so views come first that show what no other
// one does. All is angles and shares of the image, so the choice does not depend on the resolution.
#pragma once

#include <cstdint>
#include <limits>
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
    float squared_apart = std::numeric_limits<float>::infinity();  // of its direction and the nearest one that was taken
    std::int64_t gain = 0;                                         // at this point, were its view taken next
    Eigen::Vector3f to_source;
  };
  struct Point {
    std::size_t begin = 0, end = 0;  // of its witnesses
    float weight = 0;
    float shown = 0;  // worth times novelty of the views that were taken
  };

  void FindViews(std::span<const ViewSample> samples, const std::vector<std::uint32_t>& image_ids);
  void SetGains(const Point& point);
  void Add(int candidate);
  void Add(Point* point, const Witness& taken);

  float scale_;
  std::vector<int> views_;                        // that samples name, by image id
  std::vector<int> candidate_of_view_;            // index into views_
  std::vector<std::int64_t> gains_;               // as views_: sums of the witnesses'
  std::vector<std::vector<std::size_t>> points_of_;  // as views_: where it is a witness
  std::vector<Witness> witnesses_;
  std::vector<Point> points_;
};

}  // namespace phi
