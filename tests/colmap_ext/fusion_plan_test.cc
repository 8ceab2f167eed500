#include "colmap_ext/fusion/fusion_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <vector>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Images in a row, each with the `reach` images before and after it as neighbours.
NeighborGraph Row(int count, int reach) {
  NeighborGraph graph(static_cast<std::size_t>(count));
  for (int p = 0; p < count; ++p) {
    for (int other = std::max(0, p - reach); other <= std::min(count - 1, p + reach); ++other) {
      if (other != p) graph[static_cast<std::size_t>(p)].push_back(other);
    }
  }
  return graph;
}

// Follows the plan: what a step needs is there, nothing is read that is there, and the budget holds.
void ExpectSound(const FusionPlan& plan, std::size_t max_resident) {
  std::set<int> resident;
  for (const FusionStep& step : plan.steps) {
    for (const int image : step.drop) EXPECT_EQ(resident.erase(image), 1u);
    for (const int image : step.load) EXPECT_TRUE(resident.insert(image).second);
    EXPECT_TRUE(resident.contains(step.reference));
    for (const int image : step.neighbors) EXPECT_TRUE(resident.contains(image));
    for (const int image : step.load_ahead) EXPECT_TRUE(resident.insert(image).second);
    EXPECT_LE(resident.size(), max_resident);
  }
}

std::vector<int> FromEndToEnd(int count) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

TEST(FusionPlan, ReadsEveryMapOnceWhenTheWindowFits) {
  const NeighborGraph graph = Row(500, 3);
  const std::vector<std::int64_t> bytes(500, 10);
  const FusionPlan plan = PlanFusion(graph, FromEndToEnd(500), bytes, 70);
  EXPECT_EQ(plan.num_loads, 500);
  EXPECT_EQ(FindShortage(graph, bytes, 70).num_images, 0);
  EXPECT_EQ(plan.steps.size(), 500u);
  ExpectSound(plan, 7);
}

TEST(FusionPlan, KeepsWithinTheBudgetWhereOrderCannotHelp) {
  // Everyone needs everyone, and half fit: the rest goes without, and says so.
  const NeighborGraph graph = Row(20, 20);
  const std::vector<std::int64_t> bytes(20, 10);
  const FusionPlan plan = PlanFusion(graph, FromEndToEnd(20), bytes, 100);
  ExpectSound(plan, 10);
  const MemoryShortage shortage = FindShortage(graph, bytes, 100);
  EXPECT_EQ(shortage.num_images, 20);
  EXPECT_EQ(shortage.bytes_wanted, 200);
  EXPECT_EQ(FindShortage(graph, bytes, 199).num_images, 20);
  EXPECT_EQ(FindShortage(graph, bytes, 200).num_images, 0);
  for (const FusionStep& step : plan.steps) EXPECT_EQ(step.neighbors.size(), 9u);
}

TEST(FusionPlan, ANeighbourThatDoesNotFitLeavesItsPlaceToSmallerOnes) {
  const NeighborGraph graph = {{1, 2, 3, 4}, {0}, {0}, {0}, {0}};
  const std::vector<std::int64_t> bytes = {10, 40, 10, 10, 10};
  EXPECT_THAT(PlanFusion(graph, {0}, bytes, 45).steps[0].neighbors, testing::ElementsAre(2, 3, 4));
  EXPECT_THAT(PlanFusion(graph, {0}, bytes, 35).steps[0].neighbors, testing::ElementsAre(2, 3));
  EXPECT_THAT(PlanFusion(graph, {0}, bytes, 65).steps[0].neighbors, testing::ElementsAre(1, 2));
  EXPECT_EQ(FindShortage(graph, bytes, 65).bytes_wanted, 80);
}

TEST(FusionPlan, DropsWhatIsNeededLast) {
  // A hub that all six others see: it must never be read twice.
  NeighborGraph graph(7);
  for (int p = 1; p < 7; ++p) {
    graph[0].push_back(p);
    graph[static_cast<std::size_t>(p)].push_back(0);
  }
  const FusionPlan plan = PlanFusion(graph, {1, 2, 3, 4, 5, 6, 0}, std::vector<std::int64_t>(7, 10), 70);
  EXPECT_EQ(plan.num_loads, 7);
  std::vector<int> loads;
  for (const FusionStep& step : plan.steps) {
    loads.insert(loads.end(), step.load.begin(), step.load.end());
    loads.insert(loads.end(), step.load_ahead.begin(), step.load_ahead.end());
  }
  EXPECT_EQ(std::count(loads.begin(), loads.end(), 0), 1);
}

TEST(FusionPlan, SaysWhatItNeedsWhenTheBudgetIsHopeless) {
  const NeighborGraph graph = Row(5, 4);
  EXPECT_THROW(PlanFusion(graph, FromEndToEnd(5), std::vector<std::int64_t>(5, 10), 20),
               phi::ResourceError);
}

}  // namespace
}  // namespace colmap_ext
