// The text of a script: one command of axisctl per line. Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axisd::axisctl {

struct ScriptLine {
  int number = 0;  ///< in the file, from 1
  std::vector<std::string> words;
};

/// The lines that hold a command. Words are separated by blanks, '...' and "..." keep theirs, # begins a
/// comment, and a line may begin with "axisctl". `name` leads the text of errors. Throws Failure (usage).
std::vector<ScriptLine> parse_script(std::string_view text, std::string_view name);

/// The line as one would type it.
std::string text_of(const ScriptLine& line);

}  // namespace axisd::axisctl
