// The kinds of call that a backend takes.
#pragma once

namespace phi::gpu {

enum class CallKind { kEstimation, kSharing, kFilter, kInference };

inline constexpr CallKind kCallKinds[] = {CallKind::kEstimation, CallKind::kSharing, CallKind::kFilter,
                                          CallKind::kInference};
inline constexpr int kNumCallKinds = 4;

// As phi::DeviceStageTime tells them.
constexpr const char* NameOf(CallKind kind) {
  switch (kind) {
    case CallKind::kEstimation:
      return "estimation";
    case CallKind::kSharing:
      return "sharing";
    case CallKind::kFilter:
      return "filter";
    case CallKind::kInference:
      return "inference";
  }
  return "";
}

}  // namespace phi::gpu
