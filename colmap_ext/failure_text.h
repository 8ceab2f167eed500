// What is wrong with single images, told short: however many there are, they fill a few lines.
#pragma once

#include <string>
#include <vector>

#include "phi/base/message.h"

namespace colmap_ext {

// Of a message about an image: "a.jpg (geometric): what is wrong".
std::string DescribeFailure(const phi::Message& message);

// Of messages about images, a line for each reason, that of most images first: a few of them by name, how many more, and what the
// message of the first one says. Messages have one reason where they differ only in their image's name and in numbers that are no
// part of a path. Beyond ten reasons, a last line counts the rest. The order of the messages does not matter.
std::vector<std::string> LinesByReason(const std::vector<phi::Message>& messages);

// A heading and these lines below it.
std::string ListByReason(const std::string& heading, const std::vector<phi::Message>& messages);

}  // namespace colmap_ext
