#include "api/axisctl/script.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>
#include <sstream>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

constexpr std::string_view blanks = " \t\r";

/// Nothing if a quotation has no end.
std::optional<std::vector<std::string>> words_of(std::string_view line) {
  std::vector<std::string> words;
  std::optional<std::string> word;  // an empty one is a word, too: ""
  char quote = '\0';
  for (const char c : line) {
    if (quote != '\0' && c != quote) {
      *word += c;
    } else if (quote != '\0') {
      quote = '\0';
    } else if (c == '\'' || c == '"') {
      quote = c;
      if (!word) word.emplace();
    } else if (blanks.contains(c)) {
      if (word) words.push_back(*std::exchange(word, std::nullopt));
    } else if (c == '#' && !word) {
      break;
    } else {
      if (!word) word.emplace();
      *word += c;
    }
  }
  if (quote != '\0') return std::nullopt;
  if (word) words.push_back(*word);
  return words;
}

}  // namespace

std::vector<ScriptLine> parse_script(std::string_view text, std::string_view name) {
  std::vector<ScriptLine> lines;
  std::istringstream source{std::string(text)};
  int number = 0;
  for (std::string line; std::getline(source, line);) {
    ++number;
    auto words = words_of(line);
    if (!words) throw Failure(ExitCode::usage, fmt::format("{}:{}: a quotation has no end", name, number));
    if (!words->empty() && words->front() == "axisctl") words->erase(words->begin());
    if (!words->empty()) lines.push_back({.number = number, .words = std::move(*words)});
  }
  return lines;
}

std::string text_of(const ScriptLine& line) {
  std::vector<std::string> words = line.words;
  for (auto& word : words)
    if (word.empty() || word.find_first_of(" \t#\"") != std::string::npos) word = fmt::format("'{}'", word);
  return fmt::format("{}", fmt::join(words, " "));
}

}  // namespace axisd::axisctl
