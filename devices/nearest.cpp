#include "devices/nearest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace axisd {
namespace {

constexpr std::size_t longest_name = 60;

/// Whoever wrote the name may have written anything.
std::string shown(std::string_view name) {
  std::string text(name.substr(0, longest_name));
  std::ranges::replace_if(text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return name.size() > longest_name ? text + "..." : text;
}

/// Of letters left out, added, replaced, or exchanged with the next one.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, above(b.size() + 1), row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    before = std::exchange(above, row);
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = std::min({above[j] + (a[i] == b[j] ? 0 : 1), row[j] + 1, above[j + 1] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j])
        row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
    }
  }
  return row.back();
}

}  // namespace

std::string_view nearest(std::string_view text, std::span<const std::string_view> candidates) {
  if (text.size() > longest_name) return {};
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  std::ranges::replace(lower, '-', '_');
  std::string_view best;
  std::size_t least = std::max<std::size_t>(1, text.size() / 3) + 1;
  for (const auto candidate : candidates) {
    const auto distance = std::min(edit_distance(text, candidate), edit_distance(lower, candidate));
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view text, const std::vector<std::string>& candidates,
                         std::string_view otherwise) {
  const std::vector<std::string_view> names(candidates.begin(), candidates.end());
  const auto near = nearest(text, names);
  return near.empty() ? std::string(otherwise) : fmt::format("did you mean '{}'?", near);
}

Error no_such_axis(std::string_view name, const std::vector<std::string>& axes) {
  return {.reason = Reason::unknown_axis,
          .message = fmt::format("there is no axis '{}'", shown(name)),
          .remedy = did_you_mean(name, axes, "list them: axisctl list, or ListAxes")};
}

Error no_such_group(std::string_view name, const std::vector<std::string>& groups,
                    const std::vector<std::string>& axes) {
  const bool is_axis = std::ranges::find(axes, name) != axes.end();
  return {.reason = Reason::unknown_axis,
          .message = fmt::format("there is no group '{}'", shown(name)),
          .remedy = is_axis ? "it is an axis: name it as one"
                            : did_you_mean(name, groups, "list them: axisctl group list, or ListGroups")};
}

}  // namespace axisd
