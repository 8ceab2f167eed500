// Errors that reach the user. Each message names image, file and stage where they apply, and says what to do.
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>

#include "phi/base/message.h"

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
  Error(ExitCode code, Message message)
      : std::runtime_error(message.text), code_(code), message_(std::make_shared<const Message>(std::move(message))) {}
  ExitCode code() const { return code_; }
  // what(), and the file, the image and the stage that it is about.
  const Message& message() const { return *message_; }

 private:
  ExitCode code_;
  std::shared_ptr<const Message> message_;  // shared: copies of an error must not throw
};

struct UsageError : Error {
  explicit UsageError(Message message) : Error(ExitCode::kUsage, std::move(message)) {}
};
struct InputError : Error {
  explicit InputError(Message message) : Error(ExitCode::kBadInput, std::move(message)) {}
};
struct ResourceError : Error {
  explicit ResourceError(Message message) : Error(ExitCode::kOutOfResources, std::move(message)) {}
};
// There is no device of the kind that was asked for.
struct NoDeviceError : Error {
  explicit NoDeviceError(Message message) : Error(ExitCode::kNoDevice, std::move(message)) {}
};

}  // namespace phi
