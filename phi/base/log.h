// A small log sink. The library logs through it; the application decides where the lines go (stderr by
// default).
#pragma once

#include <functional>
#include <string>

#include "phi/base/message.h"

namespace phi {

enum class LogLevel { kError = 0, kWarning = 1, kInfo = 2, kDebug = 3 };

// One that takes a std::string gets the sentences alone.
using LogSink = std::function<void(LogLevel, const Message&)>;

// Replaces the sink; thread-safe, as logging is. An empty sink restores the default (stderr).
void SetLogSink(LogSink sink);
void SetLogLevel(LogLevel level);
LogLevel GetLogLevel();

// Puts the time of day (UTC, ISO 8601) before each line; off at first.
void SetLogTimestamps(bool on);
// The line as the default sink prints it: time of day if wanted, "warning: " or "error: ", the message.
std::string LogLine(LogLevel level, const std::string& message);

void Log(LogLevel level, const Message& message);
inline void LogError(const Message& m) { Log(LogLevel::kError, m); }
inline void LogWarning(const Message& m) { Log(LogLevel::kWarning, m); }
inline void LogInfo(const Message& m) { Log(LogLevel::kInfo, m); }
inline void LogDebug(const Message& m) { Log(LogLevel::kDebug, m); }

}  // namespace phi
