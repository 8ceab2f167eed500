// Errors that reach the user. Each message names image, file and stage where they apply, and says what to do.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace phi {

// The process exit code that a command ends with.
enum class ExitCode { kOk = 0, kUsage = 1, kBadInput = 2, kOutOfResources = 3, kSomeImagesFailed = 4, kNoDevice = 5 };

// Of a command that does what it can: bad input where nothing could be done.
inline ExitCode CodeOfFailures(std::size_t num_failed, std::size_t num_all) {
  if (num_failed == 0) return ExitCode::kOk;
  return num_failed >= num_all ? ExitCode::kBadInput : ExitCode::kSomeImagesFailed;
}

class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

struct UsageError : Error {
  explicit UsageError(const std::string& message) : Error(ExitCode::kUsage, message) {}
};
struct InputError : Error {
  explicit InputError(const std::string& message) : Error(ExitCode::kBadInput, message) {}
};
struct ResourceError : Error {
  explicit ResourceError(const std::string& message) : Error(ExitCode::kOutOfResources, message) {}
};
// There is no device of the kind that was asked for.
struct NoDeviceError : Error {
  explicit NoDeviceError(const std::string& message) : Error(ExitCode::kNoDevice, message) {}
};

}  // namespace phi
