// Threads that are joined whatever happens, and a clear error where the system starts no more of them.
#pragma once

#include <functional>
#include <thread>
#include <vector>

namespace colmap_ext {

// Not thread-safe.
class ThreadGroup {
 public:
  ThreadGroup() = default;
  ~ThreadGroup() { Join(); }
  ThreadGroup(const ThreadGroup&) = delete;
  ThreadGroup& operator=(const ThreadGroup&) = delete;

  // Throws phi::ResourceError when the system starts no more threads (ulimit -u). What was started goes on: the caller
  // asks it to end before the group is destroyed.
  void Start(std::function<void()> work);
  // Work that need not be done: where no thread starts, only the log says so.
  void StartIfPossible(std::function<void()> work);
  void Join();

 private:
  std::vector<std::thread> threads_;
};

}  // namespace colmap_ext
