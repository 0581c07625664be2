// What error messages do with text that somebody else wrote.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "devices/nearest.hpp"

namespace axisd::config {

/// Valid UTF-8 without control characters, shortened to about `longest` bytes.
std::string printable(std::string_view text, std::size_t longest = 60);
/// The same in single quotes.
std::string quoted(std::string_view text);
/// "a, b or c".
std::string alternatives(std::span<const std::string_view> items);
using axisd::nearest;
/// "did you mean 'velocity'?", or "permitted: a, b or c" if nothing is near.
std::string suggest(std::string_view text, std::span<const std::string_view> candidates);

/// The names of a list of specifications.
template <class Range, class Projection>
std::vector<std::string_view> names_of(const Range& range, Projection name) {
  std::vector<std::string_view> names;
  names.reserve(std::size(range));
  for (const auto& item : range) names.push_back(name(item));
  return names;
}

}  // namespace axisd::config
