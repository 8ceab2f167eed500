// Runs one task per image over all devices: a shared queue, from which every worker takes its next image.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "phi/backend.h"

namespace colmap_ext {

struct TaskFailure {
  int task = 0;
  std::string message;
};

// Called from several threads at once.
using TaskFunction = std::function<void(int task, phi::Backend& backend)>;

// Each backend gets NumConcurrentImages() workers. phi::InputError fails the task alone, and the others go
// on. phi::DeviceError fails the device: its tasks go back to the queue, and the other devices do them. Any other error, a
// cancellation and the failure of the last device stop the queue once the running tasks have ended, and are thrown.
// Failures come back in the order of `tasks`.
std::vector<TaskFailure> RunTasks(const std::vector<int>& tasks,
                                  const std::vector<std::unique_ptr<phi::Backend>>& backends,
                                  const TaskFunction& run);

}  // namespace colmap_ext
