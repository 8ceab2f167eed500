// Parts of a scene that can be fused one without the other, by nested dissection of the graph of neighbours: images that
// separate two halves come first, then either half alone, and so on until few images are left. An image depends on those of its
// neighbours that are fused before it, so that nothing passes between halves. The parts follow from the graph alone, whoever
// fuses how many of them.
#pragma once

#include <vector>

#include "colmap_ext/fusion/neighbor_graph.h"

namespace colmap_ext {

// Positions as in NeighborGraph, in the order in which they are fused.
using FusionPart = std::vector<int>;

// In the order of fusion: separators before what they separate. At most `max_images` in each, but for images that nothing
// separates, since all are neighbours of all.
std::vector<FusionPart> DissectImages(const NeighborGraph& graph, int max_images);

// By part: the earlier parts with neighbours of its images, ascending.
std::vector<std::vector<int>> FindEarlierParts(const NeighborGraph& graph, const std::vector<FusionPart>& parts);

// All parts, one after the other.
std::vector<int> OrderOf(const std::vector<FusionPart>& parts);

}  // namespace colmap_ext
