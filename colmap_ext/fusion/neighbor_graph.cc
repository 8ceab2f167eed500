#include "colmap_ext/fusion/neighbor_graph.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <tuple>
#include <unordered_map>

#include "colmap_ext/patch_match_config.h"

namespace colmap_ext {
namespace {

// Images with fewer neighbours by sparse points than these get more by camera position.
constexpr int kFewNeighbors = 8;

struct Pair {
  std::int64_t strength = 0;
  int first = 0, second = 0;  // positions, first < second
};

class PairTable {
 public:
  // Strengths of the same pair add up.
  void Add(int a, int b, std::int64_t strength) {
    if (a == b) return;
    strength_[(static_cast<std::uint64_t>(std::min(a, b)) << 32) |
              static_cast<std::uint64_t>(std::max(a, b))] += strength;
  }

  // Strongest first; ties by position.
  std::vector<Pair> Sorted() const {
    std::vector<Pair> pairs;
    pairs.reserve(strength_.size());
    for (const auto& [key, strength] : strength_) {
      pairs.push_back({strength, static_cast<int>(key >> 32), static_cast<int>(key & 0xffffffffu)});
    }
    std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
      return std::tuple(-a.strength, a.first, a.second) < std::tuple(-b.strength, b.first, b.second);
    });
    return pairs;
  }

 private:
  std::unordered_map<std::uint64_t, std::int64_t> strength_;
};

void AddSharedPoints(const SparseModel& model, const std::vector<int>& position_of_image, PairTable* pairs) {
  std::unordered_map<std::uint32_t, int> position_of_id;
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    if (position_of_image[i] >= 0) position_of_id[model.images[i].image_id] = position_of_image[i];
  }
  std::vector<int> seen;
  for (const SparsePoint& point : model.points) {
    seen.clear();
    for (const TrackElement& element : point.track) {
      const auto found = position_of_id.find(element.image_id);
      if (found != position_of_id.end()) seen.push_back(found->second);
    }
    std::sort(seen.begin(), seen.end());
    seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
    for (std::size_t a = 0; a < seen.size(); ++a) {
      for (std::size_t b = a + 1; b < seen.size(); ++b) pairs->Add(seen[a], seen[b], 1);
    }
  }
}

void AddConfiguredPairs(const Workspace& workspace, const std::vector<int>& position_of_image,
                        PairTable* pairs) {
  if (!std::filesystem::exists(workspace.StereoFolder() / "patch-match.cfg")) return;
  ProblemList problems;  // the file's faults are the estimator's business
  for (const PatchMatchProblem& problem : ReadPatchMatchConfig(workspace, {}, &problems)) {
    if (problem.reference < 0 || position_of_image[static_cast<std::size_t>(problem.reference)] < 0) continue;
    for (const int source : problem.sources) {
      const int position = position_of_image[static_cast<std::size_t>(source)];
      if (position >= 0)
        pairs->Add(position_of_image[static_cast<std::size_t>(problem.reference)], position, 1);
    }
  }
}

bool Contains(const std::vector<int>& list, int value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

// The nearest cameras whose optical axes differ by less than 90 degrees; those at the same place after all others.
std::vector<int> NearestCameras(const Workspace& workspace, const std::vector<int>& images, const OnePlace& one_place,
                                int position, int count) {
  const auto pose = [&](int p) -> const phi::Pose& {
    return workspace.views()[static_cast<std::size_t>(images[static_cast<std::size_t>(p)])].camera.pose;
  };
  const auto image = [&](int p) { return images[static_cast<std::size_t>(p)]; };
  std::vector<std::tuple<bool, double, int>> candidates;
  for (int other = 0; other < static_cast<int>(images.size()); ++other) {
    if (other == position || pose(other).rotation.row(2).dot(pose(position).rotation.row(2)) <= 0) continue;
    candidates.emplace_back(one_place.StandTogether(image(position), image(other)),
                            (pose(other).Center() - pose(position).Center()).squaredNorm(), other);
  }
  const std::size_t kept = std::min<std::size_t>(candidates.size(), static_cast<std::size_t>(count));
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(kept),
                    candidates.end());
  std::vector<int> nearest;
  for (std::size_t i = 0; i < kept; ++i) nearest.push_back(std::get<2>(candidates[i]));
  return nearest;
}

NeighborGraph CompleteGraph(int num_images) {
  NeighborGraph graph(static_cast<std::size_t>(num_images));
  for (int a = 0; a < num_images; ++a) {
    for (int b = 0; b < num_images; ++b) {
      if (a != b) graph[static_cast<std::size_t>(a)].push_back(b);
    }
  }
  return graph;
}

}  // namespace

NeighborGraph BuildNeighborGraph(const Workspace& workspace, const std::vector<int>& images, const OnePlace& one_place,
                                 int max_neighbors) {
  if (max_neighbors < 0) return CompleteGraph(static_cast<int>(images.size()));
  std::vector<int> position_of_image(workspace.views().size(), -1);
  for (std::size_t p = 0; p < images.size(); ++p)
    position_of_image[static_cast<std::size_t>(images[p])] = static_cast<int>(p);
  PairTable pairs;
  AddSharedPoints(workspace.model(), position_of_image, &pairs);
  AddConfiguredPairs(workspace, position_of_image, &pairs);

  NeighborGraph graph(images.size());
  const auto degree = [&](int p) { return static_cast<int>(graph[static_cast<std::size_t>(p)].size()); };
  const auto connect = [&](int a, int b) {
    graph[static_cast<std::size_t>(a)].push_back(b);
    graph[static_cast<std::size_t>(b)].push_back(a);
  };
  std::vector<int> num_together(images.size(), 0);
  for (const Pair& pair : pairs.Sorted()) {
    const auto a = static_cast<std::size_t>(pair.first), b = static_cast<std::size_t>(pair.second);
    const bool stand_together = one_place.StandTogether(images[a], images[b]);
    // They share the most points, and confirm nothing: half of the places are for others.
    if (stand_together && std::max(num_together[a], num_together[b]) >= max_neighbors / 2) continue;
    // Either side may want the pair, but a popular image must not collect the whole scene.
    const int low = std::min(degree(pair.first), degree(pair.second));
    const int high = std::max(degree(pair.first), degree(pair.second));
    if (!(low < max_neighbors && high < 2 * max_neighbors)) continue;
    connect(pair.first, pair.second);
    num_together[a] += stand_together;
    num_together[b] += stand_together;
  }
  const int few = std::min(kFewNeighbors, max_neighbors);
  for (int p = 0; p < static_cast<int>(images.size()); ++p) {
    if (degree(p) >= few) continue;
    for (const int other : NearestCameras(workspace, images, one_place, p, few)) {
      if (degree(p) >= few) break;
      if (degree(other) < 2 * max_neighbors && !Contains(graph[static_cast<std::size_t>(p)], other))
        connect(p, other);
    }
  }
  return graph;
}

void KeepImagesToCome(NeighborGraph* graph) {
  for (std::size_t p = 0; p < graph->size(); ++p) {
    std::erase_if((*graph)[p], [p](int neighbor) { return static_cast<std::size_t>(neighbor) < p; });
  }
}

}  // namespace colmap_ext
