// What --help and --help_json tell of a command and its options.
#pragma once

#include <string>
#include <vector>

#include "phi/base/option.h"

namespace colmap_ext {

struct CommandDescription {
  const std::string &command, &summary;
  const phi::OptionList& options;
  std::vector<std::string> only_colmap;  // names of COLMAP's options that are accepted and have no effect
};

// What stands before the point of an option's name; empty where there is none.
std::string GroupOf(const std::string& name);

// On the standard output, as wide as the terminal.
void PrintHelp(const CommandDescription& description);
// A JSON object on the standard output, or in this thread's JsonHelp.
void PrintJsonHelp(const CommandDescription& description);

// As long as it lives, what --help_json gives in this thread is its text, and is not printed: another thread may have the
// standard output.
class JsonHelp {
 public:
  JsonHelp();
  ~JsonHelp();
  JsonHelp(const JsonHelp&) = delete;
  JsonHelp& operator=(const JsonHelp&) = delete;
  const std::string& text() const { return text_; }

 private:
  friend void PrintJsonHelp(const CommandDescription& description);
  std::string text_;
  JsonHelp* const before_;
};

}  // namespace colmap_ext
