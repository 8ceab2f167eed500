// What an action complains about.
#pragma once

#include <string>

#include "phi/base/error.h"

namespace test_support {

// The message of the Error (phi::InputError, ...) that the action throws, with what it is about; "nothing was thrown" when it
// does not.
template <typename Error, typename Action>
phi::Message WholeMessageOf(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.message();
  }
  return "nothing was thrown";
}

template <typename Error, typename Action>
std::string MessageOf(const Action& action) {
  return WholeMessageOf<Error>(action).text;
}

template <typename Action>
std::string InputErrorOf(const Action& action) {
  return MessageOf<phi::InputError>(action);
}

}  // namespace test_support
