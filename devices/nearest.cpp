#include "devices/nearest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
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

/// Of letters left out, added, replaced, or exchanged with the next one; whatever is `most` or more is
/// `most`. Precondition: `a` is no longer than longest_name, and `most` than longest_name / 3 + 1.
std::size_t edit_distance(std::string_view a, std::string_view b, std::size_t most) {
  if (std::max(a.size(), b.size()) - std::min(a.size(), b.size()) >= most) return most;
  std::array<std::size_t, longest_name + longest_name / 3 + 1> rows[3];
  auto *before = &rows[0], *above = &rows[1], *row = &rows[2];
  std::iota(row->begin(), row->begin() + static_cast<std::ptrdiff_t>(b.size()) + 1, std::size_t{0});
  std::size_t least = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    row = std::exchange(before, std::exchange(above, row));
    (*row)[0] = i + 1;
    const auto least_above = std::exchange(least, i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      auto& distance = (*row)[j + 1];
      distance = std::min({(*above)[j] + (a[i] == b[j] ? 0 : 1), (*row)[j] + 1, (*above)[j + 1] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j])
        distance = std::min(distance, (*before)[j - 1] + 1);
      least = std::min(least, distance);
    }
    // All that comes is reached from this row, or by an exchange from the one above it.
    if (least >= most && least_above + 1 >= most) return most;
  }
  return std::min(row->at(b.size()), most);
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
    auto distance = edit_distance(text, candidate, least);
    if (lower != text) distance = std::min(distance, edit_distance(lower, candidate, least));
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
