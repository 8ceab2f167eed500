// What an action complains about.
#pragma once

#include <string>

#include "phi/base/error.h"

namespace test_support {

// The message of the Error (phi::InputError, ...) that the action throws; "nothing was thrown" when it does
// not.
template <typename Error, typename Action>
std::string MessageOf(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

template <typename Action>
std::string InputErrorOf(const Action& action) {
  return MessageOf<phi::InputError>(action);
}

}  // namespace test_support
