#include "colmap_ext/pipeline/task_queue.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

struct Queue {
  const std::vector<int>& tasks;
  const TaskFunction& run;
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex mutex{};  // guards what follows
  std::exception_ptr error{};
  std::vector<std::optional<std::string>> failures{};  // parallel to tasks

  void Fail(std::size_t index, const std::string& message) {
    std::lock_guard<std::mutex> lock(mutex);
    failures[index] = message;
  }

  void Stop() {
    std::lock_guard<std::mutex> lock(mutex);
    if (!error) error = std::current_exception();
    stop = true;
  }
};

void Work(Queue& queue, phi::Backend& backend) {
  while (!queue.stop) {
    const std::size_t index = queue.next++;
    if (index >= queue.tasks.size()) return;
    try {
      phi::ThrowIfCancelled();
      queue.run(queue.tasks[index], backend);
    } catch (const phi::InputError& error) {
      queue.Fail(index, error.what());
    } catch (...) {
      queue.Stop();
    }
  }
}

}  // namespace

std::vector<TaskFailure> RunTasks(const std::vector<int>& tasks,
                                  const std::vector<std::unique_ptr<phi::Backend>>& backends,
                                  const TaskFunction& run) {
  Queue queue{.tasks = tasks, .run = run};
  queue.failures.resize(tasks.size());
  std::vector<std::thread> workers;
  for (const auto& backend : backends) {
    for (int i = 0; i < std::max(1, backend->NumConcurrentImages()); ++i) {
      workers.emplace_back([&queue, &backend] { Work(queue, *backend); });
    }
  }
  for (std::thread& worker : workers) worker.join();
  if (queue.error) std::rethrow_exception(queue.error);
  std::vector<TaskFailure> failures;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (queue.failures[i]) failures.push_back({tasks[i], *queue.failures[i]});
  }
  return failures;
}

}  // namespace colmap_ext
