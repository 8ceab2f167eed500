#include "phi/fusion/support_pixel.h"

#include <algorithm>
#include <cmath>

namespace phi {
namespace {

// 1 at no error, 0 at the gate and beyond.
float SoftAgreement(float error, float gate) {
  const float r = error / gate;
  return r < 1 ? 1 - r * r : 0;
}

// A pixel's longest step along a surface is depth / (focal length * slant cosine). The reference's normal serves both sides,
// so that noise in normals matters little.
bool SamplesFinely(const FusionNeighbor& neighbor, const FusionGates& gates, const ReferencePixel& reference,
                   float their_depth, Vec3f point) {
  const Vec3f normal = UnpackNormal(reference.pixel.normal);
  const float slant = std::max(gates.min_slant_cosine, -Dot(normal, reference.ray));
  const float their_slant =
      std::max(gates.min_slant_cosine, -(Dot(neighbor.view.rotation * normal, point) / point.z));
  return their_depth * reference.fx * slant <=
         gates.max_coarsening * neighbor.view.source.fx * reference.pixel.depth * their_slant;
}

// The neighbours that agree and are merged, the nearest depths' middle, and who is near it.
void FindConsensus(const FusionGates& gates, const ReferencePixel& reference, const std::vector<NeighborAnswer>& answers,
                   PixelSupport* result) {
  std::vector<float> depths = {0};  // the reference's own, relative to itself
  std::vector<std::uint32_t> agreeing;
  for (std::uint32_t k = 0; k < answers.size(); ++k) {
    if (answers[k].test != NeighborTest::kAgrees || static_cast<int>(depths.size()) >= gates.max_num_views) continue;
    depths.push_back(answers[k].relative_depth);
    agreeing.push_back(k);
  }
  std::sort(depths.begin(), depths.end());
  result->num_agreeing = static_cast<int>(depths.size());
  result->relative_depth = 0.5f * (depths[(depths.size() - 1) / 2] + depths[depths.size() / 2]);

  const auto add = [&](const FusionPixel& pixel, Vec3f normal, float relative_depth, float agreement) {
    const float nearness = SoftAgreement(std::fabs(relative_depth - result->relative_depth), gates.max_depth_error);
    if (!(nearness > 0)) return 0.0f;
    result->normal_sum = result->normal_sum + agreement * normal;
    for (int c = 0; c < 3; ++c) result->rgb_sum[c] += pixel.rgb[c];
    result->num_inferred += (pixel.flags & FusionPixel::kInferred) != 0;
    ++result->num_views;
    return nearness;
  };
  result->normal_sum = {0, 0, 0};
  result->reference_is_near = add(reference.pixel, UnpackNormal(reference.pixel.normal), 0, 1) > 0;
  for (const std::uint32_t k : agreeing) {
    const NeighborAnswer& answer = answers[k];
    const float nearness = add(answer.pixel, answer.normal, answer.relative_depth, answer.agreement);
    if (!(nearness > 0)) continue;
    result->support += nearness * answer.agreement;
    result->views.push_back(k);
  }
}

}  // namespace

NeighborAnswer AskNeighbor(const FusionNeighbor& neighbor, const FusionGates& gates, const ReferencePixel& reference) {
  NeighborAnswer answer;
  const RayModel& k = neighbor.view.source;
  const float own_depth = reference.pixel.depth;
  const Vec3f direction = neighbor.view.rotation * reference.ray;
  const Vec3f point = own_depth * direction + neighbor.view.translation;
  const ImagePoint seen = ProjectPoint(k, point);
  if (!InsideImage(k, point, seen)) return answer;
  const int column = static_cast<int>(seen.u), row = static_cast<int>(seen.v);
  answer.pixel = neighbor.map(column, row);
  const float depth = answer.pixel.depth;
  if (!(depth > 0)) return answer;

  answer.test = NeighborTest::kOtherDepth;
  const float difference = depth - point.z;
  const bool is_beyond = difference > gates.seen_through_factor * gates.max_depth_error * point.z;
  answer.sees_through = is_beyond && (answer.pixel.flags & FusionPixel::kInferred) == 0;
  if (std::fabs(difference) > gates.hopeless_factor * gates.max_depth_error * point.z) return answer;

  // The neighbour's plane, met by the reference ray.
  const Vec3f normal = UnpackNormal(answer.pixel.normal);
  const float slope = Dot(normal, direction);
  const Vec3f offset = depth * neighbor.Ray(column, row) - neighbor.view.translation;
  const float along = Dot(normal, offset) / slope;
  answer.relative_depth = along / own_depth - 1;
  const Vec3f met = along * direction + neighbor.view.translation;
  const bool meets = slope < -gates.min_ray_cosine && met.z > 0 &&
                     std::fabs(answer.relative_depth) <= gates.cover_factor * gates.max_depth_error;
  if (!meets) return answer;
  answer.sees_through = false;
  const ImagePoint agreed = ProjectPoint(k, met);
  const float du = agreed.u - seen.u, dv = agreed.v - seen.v;
  const float reproj_error = std::sqrt(du * du + dv * dv);
  answer.covers = neighbor.earlier && reproj_error <= gates.max_reproj_error &&
                  (answer.pixel.flags & FusionPixel::kEmitted) != 0 &&
                  SamplesFinely(neighbor, gates, reference, depth, point);

  if (!(std::fabs(answer.relative_depth) <= gates.max_depth_error)) return answer;
  answer.test = NeighborTest::kOtherReprojection;
  if (!(reproj_error <= gates.max_reproj_error)) return answer;
  answer.test = NeighborTest::kOtherNormal;
  const float cosine = Dot(neighbor.view.rotation * UnpackNormal(reference.pixel.normal), normal);
  if (!(cosine >= gates.min_normal_cosine)) return answer;
  answer.test = NeighborTest::kAgrees;
  answer.agreement =
      SoftAgreement(reproj_error, gates.max_reproj_error) * SoftAgreement(1 - cosine, 1 - gates.min_normal_cosine);
  answer.normal = TransposedTimes(neighbor.view.rotation, normal);
  return answer;
}

PixelSupport DecidePixel(const std::vector<FusionNeighbor>& neighbors, const FusionGates& gates,
                         const ReferencePixel& reference) {
  PixelSupport result;
  result.has_depth = reference.pixel.depth > 0;
  if (!result.has_depth) return result;
  std::vector<NeighborAnswer> answers;
  for (const FusionNeighbor& neighbor : neighbors) {
    answers.push_back(AskNeighbor(neighbor, gates, reference));
    const NeighborAnswer& answer = answers.back();
    result.is_covered = result.is_covered || answer.covers;
    result.num_other_depth += answer.test == NeighborTest::kOtherDepth;
    result.num_other_reprojection += answer.test == NeighborTest::kOtherReprojection;
    result.num_other_normal += answer.test == NeighborTest::kOtherNormal;
    result.num_seen_through += answer.sees_through;
  }
  if (!result.is_covered) FindConsensus(gates, reference, answers, &result);
  return result;
}

}  // namespace phi
