// Keeps the log's lines from the terminal while it lives, for tests that provoke them or look at them.
#pragma once

#include <string>
#include <vector>

#include "phi/base/log.h"

namespace test_support {

class LogCapture {
 public:
  LogCapture() {
    phi::SetLogSink([this](phi::LogLevel, const std::string& message) { messages_.push_back(message); });
  }
  ~LogCapture() { phi::SetLogSink({}); }
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;

  const std::vector<std::string>& messages() const { return messages_; }

 private:
  std::vector<std::string> messages_;
};

}  // namespace test_support
