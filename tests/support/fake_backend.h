// A backend whose results depend on every input in a known way, and that notes how it was called.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "phi/backend.h"
#include "phi/filtering/judge_measurements.h"

namespace test_support {

// Shared by the backends of a test.
struct FakeCalls {
  std::atomic<int> estimates{0}, filters{0}, inferences{0};
  std::atomic<int> running{0}, most_at_once{0};
  // Called at the start of each call with the stage ("estimate", ...) and the reference's name; may throw.
  std::function<void(const std::string& stage, const std::string& image)> on_call;
  std::function<void(const phi::EstimationInput& input)> on_estimate;
  std::function<void(const phi::FilterInput& input)> on_filter;
  std::function<void(const phi::InferenceInput& input)> on_infer;
  std::string emptied;  // name of an image of which the filter keeps nothing
  std::chrono::milliseconds duration{0};
};

class FakeBackend : public phi::Backend {
 public:
  FakeBackend(FakeCalls* calls, int num_concurrent) : calls_(*calls), num_concurrent_(num_concurrent) {}

  std::string Name() const override { return "fake"; }
  int NumConcurrentImages() const override { return num_concurrent_; }
  std::int64_t PeakDeviceBytes() const override { return 3000000; }
  std::vector<phi::DeviceStageTime> DeviceStageTimes() const override {
    return {{"estimation", 5, 0.5, 1e9}};
  }

  // Depth: a number of the pixel, the seed, the images and the maps that came in. Every fifth pixel has none.
  phi::EstimationResult Estimate(const phi::EstimationInput& input,
                                 const phi::StereoOptions& options) override {
    const Call call(this, "estimate", *input.reference.view);
    ++calls_.estimates;
    if (calls_.on_estimate) calls_.on_estimate(input);
    const phi::GrayImage& gray = *input.reference.image;
    phi::EstimationResult result{phi::PlaneMap(gray.width(), gray.height()),
                                 phi::CostMap(gray.width(), gray.height(), 0.25f)};
    for (std::size_t i = 0; i < gray.size(); ++i) {
      float depth = 1 + gray.data()[i] + 0.5f * static_cast<float>(options.seed);
      for (const phi::ViewImage& source : input.sources) depth += 0.01f * source.image->data()[i];
      result.map.data()[i] = {{0, 0, -1}, i % 5 == 0 ? 0 : depth};
    }
    return result;
  }

  // Reads all maps and takes nothing of them.
  std::shared_ptr<const phi::MeasurementMap> Share(const phi::SharingInput& input, const phi::StereoOptions&) override {
    const Call call(this, "share", *input.own.view);
    for (const phi::SourceMap& source : input.sources) source.load();
    return input.own.map;
  }

  // Depth of the reference plus a share of the sources' depths: shows which maps a filter has read.
  phi::MeasurementMap Filter(const phi::FilterInput& input, const phi::FilterOptions&) override {
    const Call call(this, "filter", *input.reference.view);
    ++calls_.filters;
    if (calls_.on_filter) calls_.on_filter(input);
    phi::MeasurementMap kept = Kept(input);
    if (input.judgement) {
      const bool is_emptied = input.reference.view->name == calls_.emptied;
      const phi::Array2D<phi::Testimonies> testimonies(kept.width(), kept.height(), is_emptied ? phi::Testimonies{} : phi::Testimonies{8, 8, 0});
      phi::JudgeMeasurements(*input.judgement, input.reference.map->planes, testimonies, &kept);
    }
    return kept;
  }

  phi::InferenceResult Infer(const phi::InferenceInput& input, const phi::StereoOptions&,
                             const phi::InferenceOptions&) override {
    const Call call(this, "infer", *input.reference.view);
    ++calls_.inferences;
    if (calls_.on_infer) calls_.on_infer(input);
    phi::InferenceResult result{*input.measured, {}};
    for (std::size_t i = 0; i < result.map.size(); ++i) {
      if (phi::IsMeasured(result.map.states.data()[i])) continue;
      result.map.planes.data()[i] = {{0, 0, -1}, 1000};
      result.map.states.data()[i] = phi::PixelState::kInferredConfirmed;
    }
    return result;
  }

 private:
  // By the filter.
  phi::MeasurementMap Kept(const phi::FilterInput& input) const {
    std::vector<std::shared_ptr<const phi::MeasurementMap>> maps;
    for (const phi::SourceMap& source : input.sources) {
      maps.push_back(source.load != nullptr ? source.load() : nullptr);
    }
    const phi::MeasurementMap& reference = *input.reference.map;
    phi::PlaneMap map = reference.planes;
    if (input.reference.view->name == calls_.emptied) {
      return phi::AllMeasured(phi::PlaneMap(map.width(), map.height()));
    }
    for (std::size_t i = 0; i < map.size(); ++i) {
      float& depth = map.data()[i].depth;
      if (!(depth > 0)) continue;
      for (const auto& source : maps) depth += source ? 0.1f * source->planes.data()[i].depth : 3;
      if (i % 7 == 0) map.data()[i] = {};
    }
    phi::MeasurementMap kept = phi::AllMeasured(std::move(map));
    for (std::size_t i = 0; i < kept.size() && !reference.states.empty(); ++i) {
      const phi::PixelState state = reference.states.data()[i];
      if (kept.states.data()[i] != phi::PixelState::kNone && phi::IsInferred(state))
        kept.states.data()[i] = state;
    }
    return kept;
  }

  // Counts the calls that run at once.
  struct Call {
    Call(FakeBackend* backend, const std::string& stage, const phi::SceneView& view)
        : calls(backend->calls_) {
      const int now = ++calls.running;
      int most = calls.most_at_once;
      while (most < now && !calls.most_at_once.compare_exchange_weak(most, now)) {
      }
      try {
        if (calls.on_call) calls.on_call(stage, view.name);
      } catch (...) {
        --calls.running;
        throw;
      }
      std::this_thread::sleep_for(calls.duration);
    }
    ~Call() { --calls.running; }
    FakeCalls& calls;
  };

  FakeCalls& calls_;
  int num_concurrent_;
};

inline std::vector<std::unique_ptr<phi::Backend>> MakeFakeBackends(FakeCalls* calls, int count,
                                                                   int num_concurrent) {
  std::vector<std::unique_ptr<phi::Backend>> backends;
  for (int i = 0; i < count; ++i) backends.push_back(std::make_unique<FakeBackend>(calls, num_concurrent));
  return backends;
}

// The calls in their order, of one backend that does an image at a time.
class CallOrder {
 public:
  explicit CallOrder(FakeCalls* calls) {
    calls->on_call = [this](const std::string& stage, const std::string& image) {
      calls_.push_back(stage + " " + image);
    };
  }
  CallOrder(const CallOrder&) = delete;
  CallOrder& operator=(const CallOrder&) = delete;

  std::size_t size() const { return calls_.size(); }
  // size() where there was no such call.
  std::ptrdiff_t Place(const std::string& stage, const std::string& image) const {
    return std::find(calls_.begin(), calls_.end(), stage + " " + image) - calls_.begin();
  }

 private:
  std::vector<std::string> calls_;
};

}  // namespace test_support
