// Readers normally throw at the first problem. The workspace checker wants them all: it passes a list, which
// collects the problems that a reader can step over.
#pragma once

#include <string>
#include <vector>

#include "phi/base/error.h"

namespace colmap_ext {

using ProblemList = std::vector<std::string>;

// Null list: throws phi::InputError.
inline void ReportProblem(ProblemList* problems, const phi::Message& message) {
  if (problems == nullptr) throw phi::InputError(message);
  problems->push_back(message.text);
}

}  // namespace colmap_ext
