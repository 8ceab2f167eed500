#include "colmap_ext/fusion/fusion_parts.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

namespace colmap_ext {
namespace {

constexpr int kOutside = -1;

class Dissection {
 public:
  Dissection(const NeighborGraph& graph, int max_images)
      : graph_(graph), max_images_(static_cast<std::size_t>(max_images)), owner_(graph.size(), kOutside),
        level_(graph.size(), kOutside), is_done_(graph.size(), 0) {}

  std::vector<FusionPart> Run() {
    std::vector<int> all(graph_.size());
    for (std::size_t p = 0; p < all.size(); ++p) all[p] = static_cast<int>(p);
    Dissect(all);
    return std::move(parts_);
  }

 private:
  struct Halves {
    std::vector<int> separator, before, after;
  };

  // `images` ascending.
  void Dissect(const std::vector<int>& images) {
    if (images.empty()) return;
    if (images.size() <= max_images_) return AddPart(images);
    for (const std::vector<int>& group : GroupComponents(images)) {
      if (group.size() <= max_images_) {
        AddPart(group);
      } else if (const Halves halves = Split(group); halves.before.empty() || halves.after.empty()) {
        AddPart(group);
      } else {
        Dissect(halves.separator);
        Dissect(halves.before);
        Dissect(halves.after);
      }
    }
  }

  // Images that no path connects, small groups of them together.
  std::vector<std::vector<int>> GroupComponents(const std::vector<int>& images) {
    Mark(images);
    std::vector<std::vector<int>> groups;
    bool is_open = false;  // the last group has space
    for (const int image : images) {
      if (level_[Index(image)] != kOutside) continue;
      const std::vector<int> component = Walk(image);
      const bool fits = is_open && groups.back().size() + component.size() <= max_images_;
      if (!fits) groups.emplace_back();
      groups.back().insert(groups.back().end(), component.begin(), component.end());
      is_open = groups.back().size() < max_images_;
    }
    for (std::vector<int>& group : groups) std::sort(group.begin(), group.end());
    return groups;
  }

  // By steps from one end of a connected group: who is as many steps away separates the nearer from the farther. Of the middle
  // half of the steps the one with the fewest images.
  Halves Split(const std::vector<int>& images) {
    int end = images.front();
    for (int i = 0; i < 3; ++i) {
      Mark(images);
      end = Walk(end).back();
    }
    std::vector<std::size_t> sizes(static_cast<std::size_t>(level_[Index(end)]) + 1, 0);
    for (const int image : images) ++sizes[Index(level_[Index(image)])];
    const int cut = ChooseLevel(sizes, images.size());
    Halves halves;
    for (const int image : images) {
      const int level = level_[Index(image)];
      const auto& neighbors = graph_[Index(image)];
      const bool separates =
          level == cut && std::any_of(neighbors.begin(), neighbors.end(), [&](int n) {
            return owner_[Index(n)] == mark_ && level_[Index(n)] > cut;
          });
      (separates ? halves.separator : level <= cut ? halves.before : halves.after).push_back(image);
    }
    return halves;
  }

  static int ChooseLevel(const std::vector<std::size_t>& sizes, std::size_t num_images) {
    int best = 0;
    std::size_t before = 0;
    std::pair<std::size_t, std::size_t> least{num_images + 1, 0};  // images, and how much larger one side is
    for (std::size_t level = 0; level + 1 < sizes.size(); ++level) {
      const std::size_t reached = before + sizes[level];
      const bool in_middle = 4 * reached > num_images && 4 * before < 3 * num_images;
      const std::size_t after = num_images - reached;
      const std::pair<std::size_t, std::size_t> cost{sizes[level], std::max(before, after) - std::min(before, after)};
      if (in_middle && cost < least) {
        least = cost;
        best = static_cast<int>(level);
      }
      before = reached;
    }
    return best;
  }

  void Mark(const std::vector<int>& images) {
    ++mark_;
    for (const int image : images) {
      owner_[Index(image)] = mark_;
      level_[Index(image)] = kOutside;
    }
  }

  // Of the marked images those that `start` is connected with, the nearest first; sets their levels.
  std::vector<int> Walk(int start) {
    std::vector<int> reached = {start};
    level_[Index(start)] = 0;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      for (const int neighbor : graph_[Index(reached[i])]) {
        if (owner_[Index(neighbor)] != mark_ || level_[Index(neighbor)] != kOutside) continue;
        level_[Index(neighbor)] = level_[Index(reached[i])] + 1;
        reached.push_back(neighbor);
      }
    }
    return reached;
  }

  // Next is always the image with most neighbours already done: their maps are in memory.
  void AddPart(const std::vector<int>& images) {
    std::vector<int> num_done(images.size(), 0);
    std::set<std::pair<int, int>> queue;  // (-done neighbours, position)
    Mark(images);
    for (std::size_t i = 0; i < images.size(); ++i) {
      level_[Index(images[i])] = static_cast<int>(i);  // its place in num_done
      for (const int neighbor : graph_[Index(images[i])]) num_done[i] += is_done_[Index(neighbor)];
      queue.insert({-num_done[i], images[i]});
    }
    FusionPart part;
    while (!queue.empty()) {
      const int next = queue.begin()->second;
      queue.erase(queue.begin());
      is_done_[Index(next)] = 1;
      part.push_back(next);
      for (const int neighbor : graph_[Index(next)]) {
        if (owner_[Index(neighbor)] != mark_ || is_done_[Index(neighbor)] != 0) continue;
        int& done = num_done[Index(level_[Index(neighbor)])];
        queue.erase({-done, neighbor});
        queue.insert({-++done, neighbor});
      }
    }
    parts_.push_back(std::move(part));
  }

  static std::size_t Index(int position) { return static_cast<std::size_t>(position); }

  const NeighborGraph& graph_;
  const std::size_t max_images_;
  int mark_ = 0;
  std::vector<int> owner_, level_;  // by position: of the last Mark that had it, and steps from the start of a walk
  std::vector<char> is_done_;
  std::vector<FusionPart> parts_;
};

}  // namespace

std::vector<FusionPart> DissectImages(const NeighborGraph& graph, int max_images) {
  return Dissection(graph, max_images).Run();
}

std::vector<std::vector<int>> FindEarlierParts(const NeighborGraph& graph, const std::vector<FusionPart>& parts) {
  std::vector<int> part_of(graph.size(), 0);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    for (const int image : parts[k]) part_of[static_cast<std::size_t>(image)] = static_cast<int>(k);
  }
  std::vector<std::vector<int>> earlier(parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    std::set<int> found;
    for (const int image : parts[k]) {
      for (const int neighbor : graph[static_cast<std::size_t>(image)]) {
        const int other = part_of[static_cast<std::size_t>(neighbor)];
        if (other < static_cast<int>(k)) found.insert(other);
      }
    }
    earlier[k].assign(found.begin(), found.end());
  }
  return earlier;
}

std::vector<int> OrderOf(const std::vector<FusionPart>& parts) {
  std::vector<int> order;
  for (const FusionPart& part : parts) order.insert(order.end(), part.begin(), part.end());
  return order;
}

}  // namespace colmap_ext
