// JSON that other programs may have written, or that a disk has damaged.
#pragma once

#include <istream>
#include <string>

#include <nlohmann/json.hpp>

#include "phi/base/error.h"

namespace colmap_ext {

// Throws Json::exception where it is no JSON, phi::InputError where it is nested so deeply that no program of ours wrote
// it: copies and output of such values recurse.
template <typename Json, typename Input>
Json ParseJson(Input&& input) {
  constexpr int kMaxDepth = 64;
  return Json::parse(input, [](int depth, typename Json::parse_event_t, Json&) {
    if (depth > kMaxDepth) throw phi::InputError("it is nested more than 64 levels deep");
    return true;
  });
}

}  // namespace colmap_ext
