// Runs work in a thread of its own while the calling thread keeps Python alive: it hands on log lines and progress to
// Python's callables, and sees Ctrl-C. No other thread touches Python.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>

namespace phimvs_python {

// Where a run tells what it does. `log`: called with (level of phi::LogLevel, text, file, image, stage), '' for what is not
// named. `progress`: None, or called with (stage, done, total, fraction, seconds, seconds_left).
struct Listeners {
  nanobind::callable log;
  nanobind::object progress;
  bool debug = false;  // whether lines of level kDebug are wanted
};

// Returns when `work` has ended, and throws what it threw, or what a callable raised, which cancels the work, as Ctrl-C does.
// Runs of several threads wait for each other, without Python's lock. Throws phi::UsageError where this thread is in a run already.
void RunSupervised(const Listeners& listeners, const std::function<void()>& work);

// Makes the run that is under way, if any, end with phi::Cancelled.
void CancelRun();

}  // namespace phimvs_python
