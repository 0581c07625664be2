#include "config/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace axisd::config {

void Diagnostics::add(Mark mark, std::string message, std::string suggestion) {
  found_.push_back({file_, mark.line, mark.column, std::move(message), std::move(suggestion)});
}

std::vector<Diagnostic> Diagnostics::sorted() const {
  auto result = found_;
  const auto order = [](const Diagnostic& d) { return std::tie(d.line, d.column, d.message, d.suggestion); };
  std::ranges::sort(result, {}, order);
  const auto rest = std::ranges::unique(result, {}, order);
  result.erase(rest.begin(), rest.end());
  return result;
}

std::string to_string(const Diagnostic& diagnostic) {
  std::string result = diagnostic.file;
  if (diagnostic.line > 0) result += fmt::format(":{}:{}", diagnostic.line, diagnostic.column);
  result += ": " + diagnostic.message;
  if (!diagnostic.suggestion.empty()) result += "; " + diagnostic.suggestion;
  return result;
}

}  // namespace axisd::config
