// A sentence for the user that knows what it is about, so that nobody has to search it for names.
#pragma once

#include <string>
#include <utility>

namespace phi {

// Empty: the sentence is about no such thing, or about several.
struct Message {
  std::string text;
  std::string file = {};   // as the user or the workspace names it
  std::string image = {};  // its name in the model
  std::string stage = {};  // as phimvs.json names it; or what else is under way, such as "fusion"

  Message() = default;
  // Most sentences are about nothing that has a name: any text is a message.
  Message(std::string sentence) : text(std::move(sentence)) {}
  Message(const char* sentence) : text(sentence) {}
  operator const std::string&() const { return text; }
  bool empty() const { return text.empty(); }
};

// About what the first is about, and where that tells nothing about what the second is.
inline Message WithContext(Message message, const Message& context) {
  if (message.file.empty()) message.file = context.file;
  if (message.image.empty()) message.image = context.image;
  if (message.stage.empty()) message.stage = context.stage;
  return message;
}

inline Message operator+(Message begin, const Message& end) {
  begin.text += end.text;
  return WithContext(std::move(begin), end);
}

// Names, as parts of sentences about them: AboutFile(path) + ": cannot be opened".
inline Message AboutFile(const std::string& path) {
  Message message(path);
  message.file = path;
  return message;
}
inline Message AboutImage(const std::string& name) {
  Message message(name);
  message.image = name;
  return message;
}
inline Message AboutStage(const std::string& name) {
  Message message(name);
  message.stage = name;
  return message;
}

}  // namespace phi
