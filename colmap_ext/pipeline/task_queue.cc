#include "colmap_ext/pipeline/task_queue.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>

#include "colmap_ext/pipeline/thread_group.h"
#include "phi/base/cancellation.h"
#include "phi/base/device_error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

struct Device {
  phi::Backend* backend = nullptr;
  bool failed = false;  // guarded by the queue's mutex
};

class Queue {
 public:
  Queue(std::size_t num_tasks, std::size_t num_devices) : num_devices_(num_devices), failures_(num_tasks) {
    for (std::size_t i = 0; i < num_tasks; ++i) waiting_.push_back(i);
  }

  // The position of the next task; nothing when all are done, or when this device or the whole queue has to stop. Waits
  // while others run: a device that fails gives its task back.
  std::optional<std::size_t> Next(const Device& device) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return error_ || device.failed || !waiting_.empty() || num_running_ == 0; });
    if (error_ || device.failed || waiting_.empty()) return {};
    const std::size_t index = waiting_.front();
    waiting_.pop_front();
    ++num_running_;
    return index;
  }

  void Done(std::size_t index, std::optional<std::string> failure) {
    Finish([&] { failures_[index] = std::move(failure); });
  }

  // The current exception ends the queue.
  void Stop() {
    Finish([&] { SetError(); });
  }

  // The current exception ends the work of a device. True when it is the device's first, and others are left.
  bool GiveBack(std::size_t index, Device* device) {
    bool others_go_on = false;
    Finish([&] {
      waiting_.push_front(index);
      if (device->failed) return;
      device->failed = true;
      others_go_on = --num_devices_ > 0;
      if (!others_go_on) SetError();
    });
    return others_go_on;
  }

  void StopUnstarted() {
    std::lock_guard<std::mutex> lock(mutex_);
    SetError();
    changed_.notify_all();
  }

  // After the last task.
  const std::vector<std::optional<std::string>>& Failures() const {
    if (error_) std::rethrow_exception(error_);
    return failures_;
  }

 private:
  template <typename Change>
  void Finish(const Change& change) {
    std::lock_guard<std::mutex> lock(mutex_);
    change();
    --num_running_;
    changed_.notify_all();
  }
  void SetError() {
    if (!error_) error_ = std::current_exception();
  }

  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<std::size_t> waiting_;
  int num_running_ = 0;
  std::size_t num_devices_;
  std::exception_ptr error_;
  std::vector<std::optional<std::string>> failures_;  // by position
};

void Work(const std::vector<int>& tasks, const TaskFunction& run, Queue* queue, Device* device) {
  while (const std::optional<std::size_t> index = queue->Next(*device)) {
    try {
      phi::ThrowIfCancelled();
      run(tasks[*index], *device->backend);
      queue->Done(*index, {});
    } catch (const phi::InputError& error) {
      queue->Done(*index, error.what());
    } catch (const phi::DeviceError& error) {
      if (!queue->GiveBack(*index, device)) continue;
      phi::LogWarning(device->backend->Name() +
                      " is left out, and the other devices do its images: " + error.what());
    } catch (...) {
      queue->Stop();
    }
  }
}

}  // namespace

std::vector<TaskFailure> RunTasks(const std::vector<int>& tasks,
                                  const std::vector<std::unique_ptr<phi::Backend>>& backends,
                                  const TaskFunction& run) {
  Queue queue(tasks.size(), backends.size());
  std::deque<Device> devices;  // workers hold addresses
  {
    ThreadGroup workers;
    try {
      for (const auto& backend : backends) {
        Device& device = devices.emplace_back(Device{.backend = backend.get()});
        for (int i = 0; i < std::max(1, backend->NumConcurrentImages()); ++i) {
          workers.Start([&, &device = device] { Work(tasks, run, &queue, &device); });
        }
      }
    } catch (...) {
      queue.StopUnstarted();  // the workers that run end after the tasks at hand
    }
  }
  std::vector<TaskFailure> result;
  const auto& failures = queue.Failures();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (failures[i]) result.push_back({tasks[i], *failures[i]});
  }
  return result;
}

}  // namespace colmap_ext
