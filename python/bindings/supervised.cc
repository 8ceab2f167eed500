#include "python/bindings/supervised.h"


#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "colmap_ext/progress.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "python/bindings/module.h"
#include "python/bindings/text_caster.h"

namespace nb = nanobind;

namespace phimvs_python {
namespace {

constexpr std::chrono::milliseconds kSignalInterval{100};

struct LogEvent {
  phi::LogLevel level;
  phi::Message message;
};

// What the work has told and Python has not heard yet.
class Mailbox {
 public:
  void Post(LogEvent event) {
    std::lock_guard<std::mutex> lock(mutex_);
    log_.push_back(std::move(event));
    changed_.notify_one();
  }
  void Post(const colmap_ext::ProgressState& state) {
    std::lock_guard<std::mutex> lock(mutex_);
    progress_ = state;  // only the newest matters
    changed_.notify_one();
  }
  void Finish() {
    std::lock_guard<std::mutex> lock(mutex_);
    finished_ = true;
    changed_.notify_one();
  }

  struct Content {
    std::deque<LogEvent> log;
    std::optional<colmap_ext::ProgressState> progress;
    bool finished = false;
  };
  Content Wait() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_for(lock, kSignalInterval, [this] { return finished_ || progress_ || !log_.empty(); });
    return {std::exchange(log_, {}), std::exchange(progress_, std::nullopt), finished_};
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<LogEvent> log_;
  std::optional<colmap_ext::ProgressState> progress_;
  bool finished_ = false;
};

// The process's sinks and flag, as long as a run has them.
class ProcessState {
 public:
  ProcessState(Mailbox* mailbox, bool debug) : level_(phi::GetLogLevel()) {
    phi::CancellationFlag() = false;
    phi::SetLogLevel(debug ? phi::LogLevel::kDebug : phi::LogLevel::kInfo);
    phi::SetLogSink([mailbox](phi::LogLevel level, const phi::Message& message) { mailbox->Post({level, message}); });
    colmap_ext::SetProgressSink([mailbox](const colmap_ext::ProgressState& state) { mailbox->Post(state); });
  }
  ~ProcessState() {
    phi::SetLogSink(nullptr);
    colmap_ext::SetProgressSink(nullptr);
    phi::SetLogLevel(level_);
    phi::CancellationFlag() = false;
  }
  ProcessState(const ProcessState&) = delete;
  ProcessState& operator=(const ProcessState&) = delete;

 private:
  const phi::LogLevel level_;
};

void Deliver(const Listeners& listeners, const Mailbox::Content& content) {
  for (const LogEvent& event : content.log) listeners.log(static_cast<int>(event.level), *TupleOf(event.message));
  if (!content.progress || listeners.progress.is_none()) return;
  const colmap_ext::ProgressState& s = *content.progress;
  listeners.progress(s.stage, s.num_done, s.num_tasks, s.fraction, s.seconds, s.seconds_left);
}

// The process's output, log and cancellation belong to one run at a time. Waits without holding Python's lock.
class OneRun {
 public:
  OneRun() : lock_(Mutex(), std::defer_lock) {
    // A callable of the run, or a signal handler: it would wait for itself.
    if (Thread() == std::this_thread::get_id()) {
      throw phi::UsageError(
          "a phimvs call is under way in this thread: what it calls, such as a progress callable, cannot start another; "
          "start that once this one has returned");
    }
    const nb::gil_scoped_release release;
    lock_.lock();
    Thread() = std::this_thread::get_id();
  }
  ~OneRun() { Thread() = std::thread::id(); }
  OneRun(const OneRun&) = delete;
  OneRun& operator=(const OneRun&) = delete;

 private:
  static std::mutex& Mutex() {
    static std::mutex mutex;
    return mutex;
  }
  // That holds the mutex.
  static std::atomic<std::thread::id>& Thread() {
    static std::atomic<std::thread::id> thread;
    return thread;
  }

  std::unique_lock<std::mutex> lock_;
};

}  // namespace

void RunSupervised(const Listeners& listeners, const std::function<void()>& work) {
  const OneRun one_run;
  Mailbox mailbox;
  const ProcessState state(&mailbox, listeners.debug);
  std::exception_ptr error;
  std::thread thread([&] {
    try {
      work();
    } catch (...) {
      error = std::current_exception();
    }
    mailbox.Finish();
  });
  std::optional<nb::python_error> raised;  // by a callable or a signal handler; the first one counts
  for (bool finished = false; !finished;) {
    Mailbox::Content content;
    {
      const nb::gil_scoped_release release;
      content = mailbox.Wait();
    }
    finished = content.finished;
    try {
      if (!raised) Deliver(listeners, content);
      if (!raised && PyErr_CheckSignals() != 0) nb::raise_python_error();
    } catch (nb::python_error& python_error) {
      raised.emplace(std::move(python_error));
      CancelRun();
    }
  }
  {
    const nb::gil_scoped_release release;
    thread.join();
  }
  if (raised) throw std::move(*raised);
  if (error) std::rethrow_exception(error);
}

void CancelRun() { phi::CancellationFlag() = true; }

}  // namespace phimvs_python
