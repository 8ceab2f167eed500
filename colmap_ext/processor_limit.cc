#include "colmap_ext/processor_limit.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <tbb/info.h>

#include "colmap_ext/control_groups.h"

namespace colmap_ext {
namespace {

// Of two numbers in microseconds. "max" and -1, which mean none, and files that are not there limit nothing.
std::optional<double> Cores(std::istream& quota, std::istream& period) {
  double quota_us = 0, period_us = 0;
  if (!(quota >> quota_us) || !(period >> period_us) || !(quota_us > 0 && period_us > 0)) return std::nullopt;
  return quota_us / period_us;
}

}  // namespace

std::optional<double> ControlGroupProcessorLimit(const std::filesystem::path& root) {
  std::optional<double> least;
  ForControlGroups(root, "cpu", [&](const std::filesystem::path& folder, GroupVersion version) {
    std::optional<double> limit;
    if (version == GroupVersion::kTwo) {
      std::ifstream both(folder / "cpu.max");
      limit = Cores(both, both);
    } else {
      std::ifstream quota(folder / "cpu.cfs_quota_us"), period(folder / "cpu.cfs_period_us");
      limit = Cores(quota, period);
    }
    if (limit) least = std::min(least.value_or(*limit), *limit);
  });
  return least;
}

int NumProcessors() {
  const int num_cores = tbb::info::default_concurrency();
  const std::optional<double> limit = ControlGroupProcessorLimit();
  return limit ? static_cast<int>(std::clamp<double>(std::ceil(*limit), 1, num_cores)) : num_cores;
}

}  // namespace colmap_ext
