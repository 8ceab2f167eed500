#include "phi/inference/plane_choice.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/inference/aligned_planes.h"
#include "phi/inference/mirror.h"
#include "phi/inference/second_surface.h"

namespace phi {
namespace {

constexpr double kFewCells = 10;       // so many at least make a share
constexpr std::size_t kFewSpots = 16;  // in fewer, where they fall is chance
// A plane is fitted again so often, as cells come to lie on it and leave; through fewer cells it stays.
constexpr int kRefits = 2;
constexpr std::size_t kFewRefitted = 6;

// So many of a region's planes may be its first when it chooses again; with all of them the maps are as good.
constexpr std::size_t kNumLikeliest = 8;

constexpr double kMinMirror = 0.5;  // reflected share, from which on a plane is a mirror

constexpr double kMaxAlignedAngle = std::numbers::pi / 180;  // as well as directions are known; radian

// Of cells so far: `on` and `behind` by weight.
struct Tally {
  Verdict counts;
  double all = 0;  // by weight

  Verdict Shares() const {
    Verdict verdict = counts;
    verdict.on /= std::max(kFewCells, all);
    verdict.behind /= std::max(kFewCells, all);
    return verdict;
  }
};

// A candidate by the cells of all views.
struct Judged {
  const PlaneCandidate* candidate;
  double on, behind;  // `on`: and what is likely beforehand
  double num_behind;

  double Score(double reflected) const { return on - (1 - reflected) * behind; }
};

class PlaneChoice {
 public:
  PlaneChoice(RegionEvidence region, const PlaneChoiceLimits& limits)
      : region_(std::move(region)), limits_(limits), open_(region_.spots.size(), 1) {
    if (region_.spots.size() < kFewSpots || !(limits.source_weight > 0)) region_.sources = {};
    enough_ =
        std::max<double>(limits.min_cells, limits.min_share * static_cast<double>(region_.cells.size()));
    for (const Spot& spot : region_.spots) box_.Add(static_cast<float>(spot.x), static_cast<float>(spot.y));
  }

  // Without cells on it a plane of the scene has no reach, until it is chosen.
  std::vector<PlaneCandidate> Candidates(const PlanesOfRegion& own, std::span<const ImagePlane> scene) const {
    std::vector<PlaneCandidate> candidates;
    for (const RegionPlane& plane : own) {
      if (plane.IsThere()) candidates.push_back({plane});
    }
    for (const ImagePlane& plane : scene) candidates.push_back({{plane}});
    std::vector<AnchorCell> cells = region_.cells;  // of all views that show a plane of it
    for (const SourceRegions& source : region_.sources) AddPlanesOf(source, &candidates, &cells);
    for (int i = 0; region_.directions != nullptr && i < SceneDirections::kCount; ++i) {
      for (const ImagePlane& plane : PlanesAlong(region_.directions->PlaneAlong(i), cells)) candidates.push_back({{plane}});
    }
    JudgeBySources(&candidates);
    return candidates;
  }

  // Those that the sources' regions chose.
  std::vector<PlaneCandidate> ChosenBySources() const {
    std::vector<PlaneCandidate> candidates;
    for (const SourceRegions& source : region_.sources) {
      for (std::size_t r = 0; r < source.regions().size(); ++r) {
        for (const RegionPlane& plane : source.ChosenBy(r)) {
          if (RegionPlane here; OffersHere(source, r, plane, &here)) candidates.push_back({here});
        }
      }
    }
    JudgeBySources(&candidates);
    return candidates;
  }

  void AskForAgreement(std::vector<PlaneCandidate>* candidates) const {
    tbb::parallel_for(std::size_t{0}, candidates->size(), [&](std::size_t i) {
      PlaneCandidate& candidate = (*candidates)[i];
      candidate.agreement = 0;
      for (const SourceRegions& source : region_.sources) {
        candidate.agreement += source.Agreement(candidate.plane, region_.spots, limits_.min_apart);
      }
    });
  }

  // Those that enough cells lie on; first what is best if all that lies behind it is its reflection. Other views alone carry no
  // second plane.
  std::vector<Judged> JudgeAll(const std::vector<PlaneCandidate>& candidates, bool is_first) const {
    std::vector<Judged> all;
    for (const PlaneCandidate& candidate : candidates) {
      const auto& [plane, others, agreement] = candidate;
      const Verdict own = Judge(plane, region_.cells);
      if (own.num_on + (is_first ? others.num_on : 0) < enough_) continue;
      // The spots are mostly the first plane's, so what other views chose for them says nothing of a second one.
      const double agreed = is_first ? limits_.agreement_weight * agreement : 0;
      all.push_back({&candidate,
                     own.on + limits_.source_weight * others.on + limits_.aligned_weight * Alignedness(plane) + agreed,
                     own.behind + limits_.source_weight * others.behind, own.num_behind + others.num_behind});
    }
    std::stable_sort(all.begin(), all.end(), [](const Judged& a, const Judged& b) { return a.Score(1) > b.Score(1); });
    return all;
  }

  // Of what JudgeAll returned; null: nothing, or `sky` says why.
  const PlaneCandidate* Best(const std::vector<Judged>& all, bool is_first, Sky* sky) const {
    const PlaneCandidate* best = nullptr;
    Sky left_for = Sky::kNot;
    double best_score = 0;
    const auto is_beaten = [&](double score) { return best != nullptr && score <= best_score; };
    for (const Judged& judged : all) {
      const RegionPlane& plane = judged.candidate->plane;
      if (is_beaten(judged.Score(1))) break;
      double score = judged.Score(0);
      if (judged.num_behind >= kFewTold) score = judged.Score(Reflected(plane));
      if (is_beaten(score)) continue;
      score -= limits_.unlike_weight * UnlikeShare(plane);
      if (is_beaten(score)) continue;
      if (const Sky beyond = is_first ? SkyBeyond(plane) : Sky::kNot; beyond != Sky::kNot) {
        left_for = std::max(left_for, beyond);
        continue;
      }
      best = judged.candidate;
      best_score = score;
    }
    *sky = best == nullptr ? left_for : Sky::kNot;
    return best;
  }

  // The plane as the region takes it.
  RegionPlane Taken(RegionPlane plane) const {
    if (AsksSources()) Refit(&plane);
    if (!plane.IsThere()) SetReach(&plane);
    return plane;
  }

  bool IsMirror(const ImagePlane& plane) const { return Reflected(plane) >= kMinMirror; }
  bool IsSecond(const ImagePlane& plane, const ImagePlane& first) const {
    return !IsNoSecondSurface(region_.cells, first, plane, limits_.min_apart);
  }

  // What the plane explains is no matter of the next one's; nor is what it reflects.
  void TakeAway(const ImagePlane& plane, bool is_mirror) {
    if (AsksBrightness()) {
      for (std::size_t i = 0; i < open_.size(); ++i) open_[i] = Unlike(plane, region_.spots[i]);
    }
    std::erase_if(region_.cells, [&](const AnchorCell& cell) {
      return IsOn(plane, cell) || (is_mirror && IsBehind(plane, cell, limits_.min_apart));
    });
  }

 private:
  // To the cells on it, in whichever view: what each view measured of a wall is the same for all, and so is the plane.
  void Refit(ImagePlane* plane) const {
    for (int round = 0; round < kRefits; ++round) {
      const std::vector<AnchorCell> on = CellsOn(*plane);
      if (on.size() < kFewRefitted) return;
      PlaneFit fit(on[0].x, on[0].y);
      for (const AnchorCell& cell : on) fit.Add(cell, cell.weight / (cell.tolerance * cell.tolerance));
      if (!(fit.NarrowVariance() > limits_.min_deviation * limits_.min_deviation)) return;
      fit.Solve(plane);
    }
  }

  // Around the cells on the plane, in whichever view.
  void SetReach(RegionPlane* plane) const {
    std::vector<AnchorCell> on = CellsOn(*plane);
    if (on.empty()) return;
    PlaneFit places(on[0].x, on[0].y);
    for (const AnchorCell& cell : on) places.Add(cell);
    const Eigen::Matrix2d own_size =
        limits_.min_deviation * limits_.min_deviation * Eigen::Matrix2d::Identity();
    plane->SetReach(places.Mean(), places.Covariance() + own_size, limits_.reach_deviations);
  }

  void JudgeBySources(std::vector<PlaneCandidate>* candidates) const {
    // One large region may be most of an image's work.
    tbb::parallel_for(std::size_t{0}, candidates->size(), [&](std::size_t i) {
      (*candidates)[i].others = JudgeOfSources((*candidates)[i].plane);
    });
  }

  // Those that its regions carry, and the cells of the regions that carry one.
  void AddPlanesOf(const SourceRegions& source, std::vector<PlaneCandidate>* candidates, std::vector<AnchorCell>* cells) const {
    std::vector<std::size_t> offering;
    for (std::size_t r = 0; r < source.regions().size(); ++r) {
      bool offers_plane = false;
      for (const RegionPlane& plane : source.regions()[r].planes) {
        RegionPlane here;
        if (!OffersHere(source, r, plane, &here)) continue;
        candidates->push_back({here});
        offers_plane = true;
      }
      if (offers_plane) offering.push_back(r);
    }
    source.ForCells(offering, [&](const AnchorCell& cell, bool continues) { cells->push_back(Weighed(cell, continues)); });
  }

  // Whether a plane of the source's region may be one of this region's, and which.
  bool OffersHere(const SourceRegions& source, std::size_t r, const RegionPlane& plane, RegionPlane* here) const {
    return plane.IsThere() && source.ToReference(plane, here) && source.Overlaps(r, plane, *here, region_.spots, box_);
  }

  Verdict Judge(const ImagePlane& plane, const std::vector<AnchorCell>& cells) const {
    Tally tally;
    Count(plane, cells, 1, &tally);
    return tally.Shares();
  }

  // By the region's cells and those of the regions that continue it.
  Verdict Judge(const ImagePlane& plane, const SourceRegions& source, std::int32_t region) const {
    const ViewRegions::Region& own = source.regions()[static_cast<std::size_t>(region)];
    Tally tally;
    Count(plane, own.cells, 1, &tally);
    for (const std::int32_t other : own.continued) {
      Count(plane, source.regions()[static_cast<std::size_t>(other)].cells, limits_.continued_weight, &tally);
    }
    return tally.Shares();
  }

  void Count(const ImagePlane& plane, const std::vector<AnchorCell>& cells, double weight, Tally* tally) const {
    for (const AnchorCell& cell : cells) {
      tally->all += weight * cell.weight;
      if (IsOn(plane, cell)) {
        const double off = cell.Off(plane);
        ++tally->counts.num_on;
        tally->counts.on += weight * cell.weight * (1 - off * off);
      } else if (IsBehind(plane, cell, limits_.min_apart)) {
        ++tally->counts.num_behind;
        tally->counts.behind += weight * cell.weight;
      }
    }
  }

  // Each view is a witness like the image itself, by the share of the spots that its regions show.
  Verdict JudgeOfSources(const ImagePlane& plane) const {
    Verdict sum;
    for (const SourceRegions& source : region_.sources) {
      ImagePlane there;
      if (!source.ToSource(plane, &there)) continue;
      for (const auto& [region, share] : source.OverlapsUnder(plane, region_.spots)) {
        const Verdict verdict = Judge(there, source, region);
        sum.on += share * verdict.on;
        sum.behind += share * verdict.behind;
        sum.num_on += share * verdict.num_on;
        sum.num_behind += verdict.num_behind;
      }
    }
    return sum;
  }

  // What the region is if it is not on the plane.
  Sky SkyBeyond(const ImagePlane& plane) const {
    if (!region_.may_be_sky) return Sky::kNot;
    return RegionSky(region_.spots, region_.views, limits_.sky).Judge(plane, [&] { return CellsOn(plane); });
  }

  // Of what lies behind the plane, in whichever view.
  double Reflected(const ImagePlane& plane) const {
    if (region_.views == nullptr || !(limits_.full_reflected > 0)) return 0;
    PlaneSides sides;
    ForCellsUnder(plane, [&](const AnchorCell& cell, bool) { sides.Add(plane, cell, limits_.min_apart); });
    return ReflectedShare(std::move(sides), region_.spots, plane, limits_.full_reflected, *region_.views);
  }

  // From 0 to 1: how nearly the plane stands along a direction of the scene.
  double Alignedness(const ImagePlane& plane) const {
    if (region_.directions == nullptr) return 0;
    const double off = region_.directions->AngleTo(plane) / kMaxAlignedAngle;
    return std::max(0.0, 1 - off * off);
  }

  bool AsksSources() const { return !region_.sources.empty(); }
  bool AsksBrightness() const { return region_.views != nullptr && limits_.unlike_weight > 0; }

  double Unlike(const ImagePlane& plane, const Spot& spot) const {
    return region_.views->Unlike(spot, plane.InverseDepth(spot.x, spot.y));
  }

  double UnlikeShare(const ImagePlane& plane) const {
    if (!AsksBrightness() || region_.spots.empty()) return 0;
    double sum = 0;
    for (std::size_t i = 0; i < open_.size(); ++i) {
      if (open_[i] > 0) sum += open_[i] * Unlike(plane, region_.spots[i]);
    }
    return sum / static_cast<double>(open_.size());
  }

  // function(cell, continues) for the region's, and those of the other views' regions that its spots fall in if they lie on the plane.
  template <typename Function>
  void ForCellsUnder(const ImagePlane& plane, const Function& function) const {
    for (const AnchorCell& cell : region_.cells) function(cell, false);
    for (const SourceRegions& source : region_.sources) {
      std::vector<std::size_t> under;
      for (const auto& overlap : source.OverlapsUnder(plane, region_.spots)) under.push_back(static_cast<std::size_t>(overlap.region));
      source.ForCells(under, function);
    }
  }

  std::vector<AnchorCell> CellsOn(const ImagePlane& plane) const {
    std::vector<AnchorCell> on;
    ForCellsUnder(plane, [&](const AnchorCell& cell, bool continues) {
      if (IsOn(plane, cell)) on.push_back(Weighed(cell, continues));
    });
    return on;
  }

  // A cell of another view's region, which one of these continues or not.
  AnchorCell Weighed(AnchorCell cell, bool continues) const {
    if (continues) cell.weight *= limits_.continued_weight;
    return cell;
  }

  RegionEvidence region_;
  PlaneChoiceLimits limits_;
  SpotBox box_;  // of the spots
  double enough_;
  std::vector<double> open_;  // of each spot, how little the planes so far explain it
};

// For choosing again.
void KeepLikeliest(const std::vector<Judged>& all, const PlaneCandidate* taken, ChosenPlanes* chosen) {
  for (const Judged& judged : all) {
    if (chosen->likeliest.size() >= kNumLikeliest && judged.candidate != taken) continue;
    if (judged.candidate == taken) chosen->taken = std::ssize(chosen->likeliest);
    chosen->likeliest.push_back(*judged.candidate);
  }
}

// `first`: the first plane; null: there is none.
ChosenPlanes TakePlanes(const std::vector<PlaneCandidate>& candidates, const PlaneCandidate* first, PlaneChoice* choice) {
  ChosenPlanes chosen;
  if (first == nullptr) return chosen;
  chosen.planes[0] = choice->Taken(first->plane);
  chosen.is_mirror = choice->IsMirror(chosen.planes[0]);
  choice->TakeAway(chosen.planes[0], chosen.is_mirror);
  Sky unasked;
  const PlaneCandidate* second = choice->Best(choice->JudgeAll(candidates, false), false, &unasked);
  if (second != nullptr && choice->IsSecond(second->plane, chosen.planes[0])) chosen.planes[1] = choice->Taken(second->plane);
  return chosen;
}

}  // namespace

ChosenPlanes ChoosePlanes(RegionEvidence region, const PlanesOfRegion& own, std::span<const ImagePlane> scene,
                          const PlaneChoiceLimits& limits) {
  PlaneChoice choice(std::move(region), limits);
  const std::vector<PlaneCandidate> candidates = choice.Candidates(own, scene);
  const std::vector<Judged> all = choice.JudgeAll(candidates, true);
  Sky sky;
  const PlaneCandidate* best = choice.Best(all, true, &sky);
  ChosenPlanes chosen = TakePlanes(candidates, best, &choice);
  chosen.sky = sky;
  if (limits.agreement_weight > 0) KeepLikeliest(all, best, &chosen);
  return chosen;
}

std::optional<ChosenPlanes> ChoosePlanesAgain(RegionEvidence region, const ChosenPlanes& before, const PlaneChoiceLimits& limits) {
  PlaneChoice choice(std::move(region), limits);
  std::vector<PlaneCandidate> candidates = before.likeliest;
  const std::vector<PlaneCandidate> of_others = choice.ChosenBySources();
  candidates.insert(candidates.end(), of_others.begin(), of_others.end());
  choice.AskForAgreement(&candidates);
  Sky sky;
  const PlaneCandidate* best = choice.Best(choice.JudgeAll(candidates, true), true, &sky);
  if (best == nullptr || best - candidates.data() == before.taken) return std::nullopt;
  return TakePlanes(candidates, best, &choice);
}

}  // namespace phi
