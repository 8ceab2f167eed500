// How far an estimation is, told now and then to whom it may concern, and what it did so far.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <vector>

#include "phi/backend.h"
#include "phi/base/images.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/matching/coarse_start.h"

namespace phi {

class EstimationWork {
 public:
  // Hypotheses that are matched for a pixel: by the initialization, and by a half pass, which does half of the pixels.
  static constexpr double kFirstHypotheses = 1, kHalfPassHypotheses = 5.5;

  // width, height: of the full image. References must outlive it.
  EstimationWork(const std::vector<EstimationPart>& parts, int width, int height,
                 const std::function<void(double)>& tell)
      : tell_(tell) {
    for (const EstimationPart& part : parts) {
      const double num_pixels = static_cast<double>(width >> part.level) * (height >> part.level);
      const int num_half_passes = 2 * (part.end_iteration - part.first_iteration);
      all_ += num_pixels * (kFirstHypotheses + num_half_passes * kHalfPassHypotheses);
    }
  }

  // From any thread. Tells each hundredth once, from one thread at a time.
  void RowDone(int width, double num_hypotheses, const EstimationCounts& counts) {
    hypotheses_ += counts.hypotheses;
    windows_ += counts.windows;
    samples_ += counts.samples;
    if (!tell_) return;
    constexpr double kStep = 0.01;
    const double added = width * num_hypotheses / all_;
    const double done = done_.fetch_add(added) + added;
    const std::unique_lock<std::mutex> lock(mutex_, std::try_to_lock);
    if (!lock || done < told_ + kStep) return;
    told_ = done;
    tell_(done < 1 ? done : 1);
  }

  // Not while rows are under way.
  EstimationCounts counts() const { return {hypotheses_, windows_, samples_}; }

 private:
  const std::function<void(double)>& tell_;
  double all_ = 0;
  std::atomic<double> done_{0};
  std::atomic<std::int64_t> hypotheses_{0}, windows_{0}, samples_{0};
  std::mutex mutex_;
  double told_ = 0;
};

}  // namespace phi
