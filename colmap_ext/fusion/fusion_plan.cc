#include "colmap_ext/fusion/fusion_plan.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <set>
#include <utility>

#include "colmap_ext/text_stream.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

constexpr int kNever = std::numeric_limits<int>::max();
// Steps that maps are read ahead for.
constexpr int kLookAhead = 64;
constexpr std::size_t kFewestNeighbors = 2;

// Of a reference's neighbours, in the graph's order, those that fit beside it.
struct FittingNeighbors {
  std::vector<int> kept;
  std::int64_t bytes_held = 0, bytes_wanted = 0;  // by the reference and those kept, and by it and all
};

FittingNeighbors FitNeighbors(int reference, const std::vector<int>& neighbors, const std::vector<std::int64_t>& bytes,
                              std::int64_t budget) {
  FittingNeighbors fitting;
  fitting.bytes_held = fitting.bytes_wanted = bytes[static_cast<std::size_t>(reference)];
  for (const int neighbor : neighbors) {
    const std::int64_t more = bytes[static_cast<std::size_t>(neighbor)];
    fitting.bytes_wanted += more;
    if (fitting.bytes_held + more > budget) continue;
    fitting.bytes_held += more;
    fitting.kept.push_back(neighbor);
  }
  return fitting;
}

class Planner {
 public:
  Planner(const std::vector<std::int64_t>& bytes, std::int64_t budget) : bytes_(bytes), budget_(budget) {}

  FusionPlan Plan(const NeighborGraph& graph, const std::vector<int>& order) {
    for (const int reference : order) AddStep(reference, graph[static_cast<std::size_t>(reference)]);
    uses_.resize(bytes_.size());
    resident_.assign(bytes_.size(), false);
    for (std::size_t s = 0; s < plan_.steps.size(); ++s) {
      for (const int image : Needs(plan_.steps[s])) Uses(image).push_back(static_cast<int>(s));
    }
    for (std::size_t s = 0; s < plan_.steps.size(); ++s) Schedule(static_cast<int>(s));
    return plan_;
  }

 private:
  static std::vector<int> Needs(const FusionStep& step) {
    std::vector<int> images = {step.reference};
    images.insert(images.end(), step.neighbors.begin(), step.neighbors.end());
    return images;
  }
  std::deque<int>& Uses(int image) { return uses_[static_cast<std::size_t>(image)]; }
  int NextUse(int image) { return Uses(image).empty() ? kNever : Uses(image).front(); }
  std::int64_t Bytes(int image) const { return bytes_[static_cast<std::size_t>(image)]; }

  void AddStep(int reference, const std::vector<int>& neighbors) {
    FusionStep step;
    step.reference = reference;
    FittingNeighbors fitting = FitNeighbors(reference, neighbors, bytes_, budget_);
    if (fitting.kept.size() < std::min(kFewestNeighbors, neighbors.size()) || fitting.bytes_held > budget_)
      ThrowTooSmall(fitting.bytes_wanted);
    step.neighbors = std::move(fitting.kept);
    plan_.steps.push_back(std::move(step));
  }

  [[noreturn]] void ThrowTooSmall(std::int64_t wanted) const {
    TextOutput out;
    out.precision(3);
    out << "fusion: one image and its neighbours need " << static_cast<double>(wanted) / 1e9
        << " GB, but maps may use " << static_cast<double>(std::max<std::int64_t>(budget_, 0)) / 1e9
        << " GB; raise --PhiFusion.max_memory_gb, or lower --StereoFusion.check_num_images or "
           "--StereoFusion.max_image_size";
    throw phi::ResourceError(out.str());
  }

  void Drop(int image, FusionStep* step) {
    residents_.erase({NextUse(image), image});
    resident_[static_cast<std::size_t>(image)] = false;
    used_bytes_ -= Bytes(image);
    step->drop.push_back(image);
  }

  void Load(int image, std::vector<int>* list) {
    resident_[static_cast<std::size_t>(image)] = true;
    residents_.insert({NextUse(image), image});
    used_bytes_ += Bytes(image);
    list->push_back(image);
    ++plan_.num_loads;
  }

  // Drops maps that are first used after `use`, the furthest first. False when that does not free enough.
  bool MakeSpace(std::int64_t bytes, int use, FusionStep* step) {
    while (used_bytes_ + bytes > budget_) {
      if (residents_.empty() || residents_.rbegin()->first <= use) return false;
      const int victim = residents_.rbegin()->second;
      // What this step itself loads cannot be dropped before it.
      if (Contains(step->load, victim) || Contains(step->load_ahead, victim)) return false;
      Drop(victim, step);
    }
    return true;
  }
  static bool Contains(const std::vector<int>& list, int image) {
    return std::find(list.begin(), list.end(), image) != list.end();
  }

  void Schedule(int s) {
    FusionStep& step = plan_.steps[static_cast<std::size_t>(s)];
    while (!residents_.empty() && residents_.rbegin()->first == kNever)
      Drop(residents_.rbegin()->second, &step);
    for (const int image : Needs(step)) {
      if (resident_[static_cast<std::size_t>(image)]) continue;
      MakeSpace(Bytes(image), s, &step);
      Load(image, &step.load);
    }
    LoadAhead(s, &step);
    for (const int image : Needs(step)) {
      residents_.erase({NextUse(image), image});
      Uses(image).pop_front();
      residents_.insert({NextUse(image), image});
    }
  }

  void LoadAhead(int s, FusionStep* step) {
    const int last = std::min<int>(static_cast<int>(plan_.steps.size()), s + 1 + kLookAhead);
    for (int t = s + 1; t < last; ++t) {
      for (const int image : Needs(plan_.steps[static_cast<std::size_t>(t)])) {
        if (resident_[static_cast<std::size_t>(image)]) continue;
        if (!MakeSpace(Bytes(image), t, step)) return;
        Load(image, &step->load_ahead);
      }
    }
  }

  const std::vector<std::int64_t>& bytes_;
  std::int64_t budget_;
  FusionPlan plan_;
  std::vector<std::deque<int>> uses_;  // steps to come
  std::vector<bool> resident_;
  std::set<std::pair<int, int>> residents_;  // (next use, image)
  std::int64_t used_bytes_ = 0;
};

}  // namespace

FusionPlan PlanFusion(const NeighborGraph& graph, const std::vector<int>& order,
                      const std::vector<std::int64_t>& bytes, std::int64_t budget_bytes) {
  return Planner(bytes, budget_bytes).Plan(graph, order);
}

MemoryShortage FindShortage(const NeighborGraph& graph, const std::vector<std::int64_t>& bytes, std::int64_t budget_bytes) {
  MemoryShortage shortage;
  for (std::size_t p = 0; p < graph.size(); ++p) {
    const FittingNeighbors fitting = FitNeighbors(static_cast<int>(p), graph[p], bytes, budget_bytes);
    shortage.num_images += fitting.kept.size() < graph[p].size();
    shortage.bytes_wanted = std::max(shortage.bytes_wanted, fitting.bytes_wanted);
  }
  return shortage;
}

}  // namespace colmap_ext
