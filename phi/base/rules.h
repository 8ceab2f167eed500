// The rules that the paper does not have (docs/development/rules.md), each with a switch for scripts/ablation --rules: off, or
// its constants times a factor. For developers alone: no part of what the program promises.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>

#include "phi/base/hd.h"

namespace phi {

// The first stage that a rule changes; the stages after it follow.
enum class RuleStage : std::uint8_t { kSourceViews, kEstimation, kFilter, kInference, kFusion };

// What a rule can be set to: off alone, where its constants mean nothing when scaled; scaled alone, where another rule rests on it.
enum class RuleSettings : std::uint8_t { kOff, kScale, kOffAndScale };

// Identifier, name, first stage, settings; the order is that of rules.md.
#define PHI_RULES(X)                                                \
  X(kViewCoverage, "view_coverage", kSourceViews, kOffAndScale)     \
  X(kWeakViews, "weak_views", kSourceViews, kOffAndScale)           \
  X(kImageCorrections, "image_corrections", kEstimation, kOffAndScale) \
  X(kSampleWeights, "sample_weights", kEstimation, kOffAndScale)    \
  X(kNarrowWindows, "narrow_windows", kEstimation, kOffAndScale)    \
  X(kReducedImages, "reduced_images", kEstimation, kOffAndScale)    \
  X(kCoarseToFine, "coarse_to_fine", kEstimation, kOffAndScale)     \
  X(kFirstHypotheses, "first_hypotheses", kEstimation, kOff)        \
  X(kViewMean, "view_mean", kEstimation, kOff)                      \
  X(kSparseRanking, "sparse_ranking", kEstimation, kOff)            \
  X(kRefinement, "refinement", kEstimation, kOffAndScale)           \
  X(kDepthBounds, "depth_bounds", kEstimation, kOffAndScale)        \
  X(kSharedHypotheses, "shared_hypotheses", kFilter, kOff)          \
  X(kOneSurfaceDepth, "one_surface_depth", kFilter, kOffAndScale)   \
  X(kFilterTolerances, "filter_tolerances", kFilter, kOffAndScale)  \
  X(kFewViews, "few_views", kFilter, kOffAndScale)                  \
  X(kEmptyViews, "empty_views", kFilter, kOffAndScale)              \
  X(kOwnTexture, "own_texture", kFilter, kOffAndScale)              \
  X(kPlainPatches, "plain_patches", kFilter, kOffAndScale)          \
  X(kClues, "clues", kFilter, kOffAndScale)                         \
  X(kDepthEdges, "depth_edges", kInference, kOffAndScale)           \
  X(kEvenRegions, "even_regions", kInference, kScale)               \
  X(kRegionPlanes, "region_planes", kInference, kOffAndScale)       \
  X(kPooledAnchors, "pooled_anchors", kInference, kOffAndScale)     \
  X(kPhotoTones, "photo_tones", kInference, kOffAndScale)           \
  X(kScenePlanes, "scene_planes", kInference, kOffAndScale)         \
  X(kSourceRegions, "source_regions", kInference, kOffAndScale)     \
  X(kSecondChoice, "second_choice", kInference, kOffAndScale)       \
  X(kRightAngles, "right_angles", kInference, kOffAndScale)         \
  X(kContinuedRegions, "continued_regions", kInference, kOffAndScale) \
  X(kCreases, "creases", kInference, kOffAndScale)                  \
  X(kShadedSurfaces, "shaded_surfaces", kInference, kOffAndScale)   \
  X(kSpotBrightness, "spot_brightness", kInference, kOffAndScale)   \
  X(kSky, "sky", kInference, kOffAndScale)                          \
  X(kLightSources, "light_sources", kInference, kOffAndScale)       \
  X(kMirrors, "mirrors", kInference, kOffAndScale)                  \
  X(kSkyRims, "sky_rims", kInference, kOffAndScale)                 \
  X(kEdgeDepths, "edge_depths", kInference, kOff)                   \
  X(kOverexposed, "overexposed", kInference, kOff)                  \
  X(kEvenLines, "even_lines", kInference, kOff)                     \
  X(kRegionsFirst, "regions_first", kInference, kOffAndScale)       \
  X(kRegionNormals, "region_normals", kInference, kOff)             \
  X(kRayAgreement, "ray_agreement", kFusion, kOffAndScale)          \
  X(kConflicts, "conflicts", kFusion, kOffAndScale)                 \
  X(kCover, "cover", kFusion, kOffAndScale)                         \
  X(kCloudHoles, "cloud_holes", kFusion, kOffAndScale)              \
  X(kMapNoise, "map_noise", kFusion, kOffAndScale)

enum class Rule : std::uint8_t {
#define PHI_RULE_ID(id, name, stage, settings) id,
  PHI_RULES(PHI_RULE_ID)
#undef PHI_RULE_ID
};

struct RuleDescription {
  const char* name;
  RuleStage stage;
  RuleSettings settings;
};

inline constexpr RuleDescription kRules[] = {
#define PHI_RULE_ROW(id, name, stage, settings) {name, RuleStage::stage, RuleSettings::settings},
    PHI_RULES(PHI_RULE_ROW)
#undef PHI_RULE_ROW
};
inline constexpr std::size_t kNumRules = std::size(kRules);

// A factor for each rule: 1 as it is, 0 off, else its constants are that many times as large; a count is rounded. Plain data:
// passed to kernels by value.
class Rules {
 public:
  PHI_HD constexpr Rules() {
    for (float& factor : factors_) factor = 1;
  }

  // 0: off.
  PHI_HD float Factor(Rule rule) const { return factors_[static_cast<std::size_t>(rule)]; }
  PHI_HD bool IsOn(Rule rule) const { return Factor(rule) > 0; }
  // For code that runs whether or not the rule is on: 1 where it is off.
  PHI_HD float Scale(Rule rule) const { return IsOn(rule) ? Factor(rule) : 1.0f; }
  // A count, scaled and rounded.
  int Count(Rule rule, int count) const;
  void Set(Rule rule, float factor) { factors_[static_cast<std::size_t>(rule)] = factor; }

  // Sets rules of `first` to `last` by "NAME=FACTOR,..."; the others of these stages to 1. Throws std::invalid_argument, which
  // says what the text must be, for a name of another stage or an unknown one, a factor outside [0, 10], and a setting that the
  // rule does not have.
  void Assign(const std::string& text, RuleStage first, RuleStage last);
  // The same text: rules with another factor than 1, in the order of kRules. Empty: all are as they are.
  std::string Text(RuleStage first, RuleStage last) const;
  // Of a stage's key: empty where its rules are as they are.
  std::string KeyText(RuleStage stage) const;

 private:
  float factors_[kNumRules] = {};
};

}  // namespace phi
