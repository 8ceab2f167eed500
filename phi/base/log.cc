#include "phi/base/log.h"

#include <atomic>
#include <cstdio>
#include <mutex>
#include <utility>

#include "phi/base/utc_time.h"

namespace phi {
namespace {

std::mutex& SinkMutex() {
  static std::mutex mutex;
  return mutex;
}

LogSink& Sink() {
  static LogSink sink;
  return sink;
}

std::atomic<int>& Level() {
  static std::atomic<int> level{static_cast<int>(LogLevel::kInfo)};
  return level;
}

std::atomic<bool>& Timestamps() {
  static std::atomic<bool> on{false};
  return on;
}

const char* Prefix(LogLevel level) {
  switch (level) {
    case LogLevel::kError:
      return "error: ";
    case LogLevel::kWarning:
      return "warning: ";
    default:
      return "";
  }
}

}  // namespace

void SetLogTimestamps(bool on) { Timestamps() = on; }

std::string LogLine(LogLevel level, const std::string& message) {
  return (Timestamps() ? UtcNow() + " " : "") + Prefix(level) + message;
}

void SetLogSink(LogSink sink) {
  std::lock_guard<std::mutex> lock(SinkMutex());
  Sink() = std::move(sink);
}

void SetLogLevel(LogLevel level) { Level() = static_cast<int>(level); }

LogLevel GetLogLevel() { return static_cast<LogLevel>(Level().load()); }

void Log(LogLevel level, const Message& message) {
  if (static_cast<int>(level) > Level()) return;
  std::lock_guard<std::mutex> lock(SinkMutex());
  if (Sink()) {
    Sink()(level, message);
  } else {
    std::fprintf(stderr, "%s\n", LogLine(level, message.text).c_str());
  }
}

}  // namespace phi
