#include "colmap_ext/pipeline/task_queue.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>

#include "colmap_ext/pipeline/thread_group.h"
#include "phi/base/cancellation.h"
#include "phi/base/device_error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

int NumWorkers(const phi::Backend& backend) { return phi::NumCallsOfAllStages(backend.NumConcurrentImages()); }

// Calls of the lowest kind that a device keeps going, and the tasks of higher kinds that wait for a worker then at most: as many maps
// are held the longer for it.
constexpr int kNumAhead = 2;
constexpr std::size_t kMaxWaiting = 16;

struct Device {
  phi::Backend* backend = nullptr;
  // Guarded by the queue's mutex.
  bool failed = false;
  std::map<int, int> num_running = {};  // by kind

  int NumRunning(int kind) const {
    const auto found = num_running.find(kind);
    return found == num_running.end() ? 0 : found->second;
  }
};

// One that has a single worker ends what it has begun.
bool GoesAhead(const Device& device) { return NumWorkers(*device.backend) > kNumAhead; }

class Queue {
 public:
  Queue(const std::vector<QueuedTask>& tasks, std::size_t num_devices)
      : tasks_(tasks),
        num_devices_(num_devices),
        num_left_(tasks.size()),
        num_needed_(tasks.size()),
        readers_(tasks.size()) {
    for (int i = 0; i < static_cast<int>(tasks.size()); ++i) {
      num_needed_[i] = tasks[i].needs.size();
      for (const int needed : tasks[i].needs) readers_[needed].push_back(i);
      if (num_needed_[i] == 0) AddReady(i);
    }
  }

  // The next task; nothing when all have ended, or when this device or the whole queue has to stop. Waits while others run,
  // which may let tasks begin: a device that fails gives its task back.
  std::optional<int> Next(Device* device) {
    std::unique_lock<std::mutex> lock(mutex_);
    std::optional<int> task;
    changed_.wait(lock, [&] {
      if (error_ || device->failed || num_left_ == 0) return true;
      task = FindReady(*device);
      return task.has_value();
    });
    if (!task) return {};
    const int kind = tasks_[*task].kind;
    ready_[kind].erase(*task);
    ++device->num_running[kind];
    return task;
  }

  void Done(int task, Device* device) {
    Finish(task, device, [&] {
      --num_left_;
      refusals_.erase(task);
      for (const int reader : readers_[task]) {
        if (--num_needed_[reader] == 0) AddReady(reader);
      }
    });
  }

  void Fail(int task, Device* device, const phi::Message& message) {
    Finish(task, device, [&] { AddFailure({task, message}); });
  }

  // Too large for the device.
  void Refuse(int task, Device* device, const phi::Message& message) {
    Finish(task, device, [&] {
      AddReady(task);
      Refusal& refusal = refusals_[task];
      refusal.message = message;
      if (!device->failed) refusal.devices.insert(device);  // meanwhile, by another of its tasks
      FailWhatNoneCanDo();
    });
  }

  // The current exception ends the queue.
  void Stop(int task, Device* device) {
    Finish(task, device, [&] { SetError(); });
  }

  // The current exception ends the work of a device. True when it is the device's first, and others are left.
  bool GiveBack(int task, Device* device) {
    bool others_go_on = false;
    Finish(task, device, [&] {
      AddReady(task);
      if (!device->failed) {
        device->failed = true;
        others_go_on = --num_devices_ > 0;
        if (!others_go_on) return SetError();
        for (auto& [refused, refusal] : refusals_) refusal.devices.erase(device);
      }
      FailWhatNoneCanDo();
    });
    return others_go_on;
  }

  void StopUnstarted() {
    std::lock_guard<std::mutex> lock(mutex_);
    SetError();
    changed_.notify_all();
  }

  // After the last task.
  QueueOutcome Outcome() const {
    if (error_) std::rethrow_exception(error_);
    QueueOutcome outcome;
    for (const auto& [task, failure] : failures_) outcome.failures.push_back(failure);
    outcome.left_out.assign(left_out_.begin(), left_out_.end());
    return outcome;
  }

 private:
  // By devices that have not failed.
  struct Refusal {
    std::set<const Device*> devices;
    phi::Message message;
  };

  void AddReady(int task) { ready_[tasks_[task].kind].insert(task); }

  void AddFailure(const TaskFailure& failure) {
    --num_left_;
    failures_.emplace(failure.task, failure);
    refusals_.erase(failure.task);
    LeaveOutReaders(failure.task);
  }

  // Of the tasks that do not run.
  void FailWhatNoneCanDo() {
    std::vector<int> hopeless;
    for (const auto& [task, refusal] : refusals_) {
      if (refusal.devices.size() == num_devices_ && ready_[tasks_[task].kind].erase(task) > 0) hopeless.push_back(task);
    }
    for (const int task : hopeless) AddFailure({task, refusals_[task].message, true});
  }

  // The earliest that the device has not refused.
  std::optional<int> First(const std::set<int>& tasks, const Device& device) const {
    for (const int task : tasks) {
      const auto refused = refusals_.find(task);
      if (refused == refusals_.end() || !refused->second.devices.contains(&device)) return task;
    }
    return {};
  }

  // Of the lowest kind that is ready, if the device goes ahead with it.
  std::optional<int> FindAhead(const Device& device) const {
    const auto lowest = std::find_if(ready_.rbegin(), ready_.rend(), [](const auto& kind) { return !kind.second.empty(); });
    if (!GoesAhead(device) || lowest == ready_.rend() || device.NumRunning(lowest->first) >= kNumAhead) return {};
    std::size_t num_waiting = 0;
    for (const auto& [kind, tasks] : ready_) num_waiting += kind > lowest->first ? tasks.size() : 0;
    if (num_waiting > kMaxWaiting) return {};
    return First(lowest->second, device);
  }

  std::optional<int> FindReady(const Device& device) const {
    if (const auto ahead = FindAhead(device)) return ahead;
    for (const auto& [kind, tasks] : ready_) {
      if (device.NumRunning(kind) >= device.backend->NumConcurrentImages()) continue;
      if (const auto task = First(tasks, device)) return task;
    }
    return {};
  }

  void LeaveOutReaders(int task) {
    for (const int reader : readers_[task]) {
      if (!left_out_.insert(reader).second) continue;
      --num_left_;
      LeaveOutReaders(reader);
    }
  }

  template <typename Change>
  void Finish(int task, Device* device, const Change& change) {
    std::lock_guard<std::mutex> lock(mutex_);
    --device->num_running[tasks_[task].kind];
    change();
    changed_.notify_all();
  }
  void SetError() {
    if (!error_) error_ = std::current_exception();
  }

  const std::vector<QueuedTask>& tasks_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::size_t num_devices_;
  std::size_t num_left_;                                // tasks that have neither ended nor been left out
  std::map<int, std::set<int>, std::greater<>> ready_;  // by kind, the highest first
  std::vector<std::size_t> num_needed_;                 // by task: of what it needs, not done yet
  std::vector<std::vector<int>> readers_;               // by task: those that need it
  std::map<int, TaskFailure> failures_;                 // by task
  std::map<int, Refusal> refusals_;                     // by task, of those that wait for another device
  std::set<int> left_out_;
  std::exception_ptr error_;
};

void Work(const TaskFunction& run, Queue* queue, Device* device) {
  while (const std::optional<int> task = queue->Next(device)) {
    try {
      phi::ThrowIfCancelled();
      run(*task, *device->backend);
      queue->Done(*task, device);
    } catch (const phi::InputError& error) {
      queue->Fail(*task, device, error.message());
    } catch (const phi::TooLargeForDevice& error) {
      queue->Refuse(*task, device, error.message());
    } catch (const phi::DeviceError& error) {
      if (!queue->GiveBack(*task, device)) continue;
      phi::LogWarning(device->backend->Name() +
                      " is left out, and the other devices do its images: " + error.what());
    } catch (...) {
      queue->Stop(*task, device);
    }
  }
}

}  // namespace

QueueOutcome RunTasks(const std::vector<QueuedTask>& tasks,
                      const std::vector<std::unique_ptr<phi::Backend>>& backends, const TaskFunction& run) {
  Queue queue(tasks, backends.size());
  std::deque<Device> devices;  // workers hold addresses
  {
    ThreadGroup workers;
    try {
      for (const auto& backend : backends) {
        Device& device = devices.emplace_back(Device{.backend = backend.get()});
        for (int i = 0; i < NumWorkers(*backend); ++i) {
          workers.Start([&, &device = device] { Work(run, &queue, &device); });
        }
      }
    } catch (...) {
      queue.StopUnstarted();  // the workers that run end after the tasks at hand
    }
  }
  return queue.Outcome();
}

}  // namespace colmap_ext
