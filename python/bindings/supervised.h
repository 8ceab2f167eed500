// Runs work in a thread of its own while the calling thread keeps Python alive: it hands on log lines and progress to
// Python's callables, and sees Ctrl-C. No other thread touches Python.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>
#include <mutex>

namespace phimvs_python {

// Where a run tells what it does. `log`: called with (level of phi::LogLevel, message). `progress`: None, or called with
// (stage, done, total, fraction, seconds, seconds_left).
struct Listeners {
  nanobind::callable log;
  nanobind::object progress;
  bool debug = false;  // whether lines of level kDebug are wanted
};

// The process's output, log and cancellation belong to one run at a time. Waits without holding Python's lock.
class OneRun {
 public:
  OneRun();

 private:
  std::unique_lock<std::mutex> lock_;
};

// Returns when `work` has ended, and throws what it threw, or what a callable raised, which cancels the work, as Ctrl-C does.
void RunSupervised(const Listeners& listeners, const std::function<void()>& work);

// Makes the run that is under way, if any, end with phi::Cancelled.
void CancelRun();

}  // namespace phimvs_python
