// Runs tasks over all devices: a shared queue, from which every worker takes the next task that waits for no other.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "phi/backend.h"
#include "phi/base/message.h"

namespace colmap_ext {

struct QueuedTask {
  int kind = 0;            // a device does at most NumConcurrentImages() tasks of one kind at a time
  std::vector<int> needs;  // tasks, by their places in the list, that must have ended well before it
};

struct TaskFailure {
  int task = 0;  // place in the list
  phi::Message message;
  bool is_too_large = false;  // for every device: no fault of the input
};

struct QueueOutcome {
  std::vector<TaskFailure> failures;  // in the order of the tasks
  std::vector<int> left_out;          // ascending: something that they need has failed or was left out
};

// Called from several threads at once.
using TaskFunction = std::function<void(int task, phi::Backend& backend)>;

// Of the tasks that wait for nothing, the one of the highest kind comes first, the earliest of these: what has been begun is
// ended before more is. A device that computes beside the host gets more workers than calls of one kind, so that what one kind does
// on the host goes on while another keeps the device busy. Two of them go ahead with the lowest kind while few tasks wait: the
// higher kinds, which work on the host for long, would leave the device idle and wait for it afterwards.
// phi::InputError fails the task alone, and the others go on. phi::TooLargeForDevice leaves the task to the other devices, and fails it
// where none can do it. phi::DeviceError else fails the device: its tasks go back to the queue, and the other devices do them. Any
// other error, a cancellation and the failure of the last device stop the queue once the running tasks have ended, and are thrown.
QueueOutcome RunTasks(const std::vector<QueuedTask>& tasks,
                      const std::vector<std::unique_ptr<phi::Backend>>& backends, const TaskFunction& run);

}  // namespace colmap_ext
