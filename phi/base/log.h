// A small log sink. The library logs through it; the application decides where the lines go (stderr by
// default).
#pragma once

#include <functional>
#include <string>

namespace phi {

enum class LogLevel { kError = 0, kWarning = 1, kInfo = 2, kDebug = 3 };

using LogSink = std::function<void(LogLevel, const std::string&)>;

// Replaces the sink; thread-safe, as logging is. An empty sink restores the default (stderr).
void SetLogSink(LogSink sink);
void SetLogLevel(LogLevel level);
LogLevel GetLogLevel();

// Puts the time of day (UTC, ISO 8601) before each line; off at first.
void SetLogTimestamps(bool on);
// The line as the default sink prints it: time of day if wanted, "warning: " or "error: ", the message.
std::string LogLine(LogLevel level, const std::string& message);

void Log(LogLevel level, const std::string& message);
inline void LogError(const std::string& m) { Log(LogLevel::kError, m); }
inline void LogWarning(const std::string& m) { Log(LogLevel::kWarning, m); }
inline void LogInfo(const std::string& m) { Log(LogLevel::kInfo, m); }
inline void LogDebug(const std::string& m) { Log(LogLevel::kDebug, m); }

}  // namespace phi
