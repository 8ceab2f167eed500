// How long the device worked on each kind of call. Calls overlap on the device, so their times are united, not summed.
#pragma once

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "cuda/call_kind.h"
#include "cuda/stream.h"

namespace phi::gpu {

class KindTime {
 public:
  void Add(double begin, double end, double samples) {
    intervals_.emplace_back(begin, end);
    samples_ += samples;
  }

  int num_images() const { return static_cast<int>(intervals_.size()); }
  double samples() const { return samples_; }  // of source images for ZNCC

  // Seconds in which at least one call's kernels were under way, or gave way to another kind's.
  double BusySeconds() const {
    std::vector<std::pair<double, double>> sorted = intervals_;
    std::sort(sorted.begin(), sorted.end());
    double busy = 0, until = 0;
    for (const auto& [begin, end] : sorted) {
      busy += std::max(0.0, end - std::max(begin, until));
      until = std::max(until, end);
    }
    return busy;
  }

 private:
  std::vector<std::pair<double, double>> intervals_;  // seconds since the origin
  double samples_ = 0;
};

class DeviceTimes {
 public:
  // The device must be current.
  explicit DeviceTimes(const Task& task) : origin_(Event::Timing::kOn, task) {
    origin_.Record(nullptr, task);
  }

  // `begin` and `end`: recorded, and passed.
  void Add(CallKind kind, const Event& begin, const Event& end, double samples, const Task& task) {
    std::lock_guard<std::mutex> lock(mutex_);
    const double from = Event::SecondsBetween(origin_, begin, task);
    times_[static_cast<int>(kind)].Add(from, from + Event::SecondsBetween(begin, end, task), samples);
  }

  const KindTime& Of(CallKind kind) const { return times_[static_cast<int>(kind)]; }

 private:
  std::mutex mutex_;
  Event origin_;
  KindTime times_[kNumCallKinds];
};

}  // namespace phi::gpu
