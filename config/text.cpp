#include "config/text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace axisd::config {

namespace {

/// What a UTF-8 sequence that begins so should have, 0 if none does.
std::size_t length_by(unsigned char lead) {
  if (lead < 0x80) return 1;
  if (lead < 0xC2 || lead >= 0xF5) return 0;
  if (lead < 0xE0) return 2;
  return lead < 0xF0 ? 3 : 4;
}

/// Length of the valid UTF-8 sequence at the front, 0 if there is none (also for overlong forms and
/// surrogates).
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  const auto length = length_by(lead);
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  if (lead == 0xE0 && byte(1) < 0xA0) return 0;
  if (lead == 0xED && byte(1) > 0x9F) return 0;
  if (lead == 0xF0 && byte(1) < 0x90) return 0;
  if (lead == 0xF4 && byte(1) > 0x8F) return 0;
  return length;
}

}  // namespace

std::string printable(std::string_view text, std::size_t longest) {
  std::string result;
  while (!text.empty()) {
    if (result.size() >= longest) return result + "...";
    const auto length = utf8_length(text);
    // C1 control characters (U+0080..U+009F) drive terminals as well as C0 does.
    const bool control = length == 1
                             ? text[0] < 0x20 || text[0] == 0x7F
                             : length == 2 && text[0] == '\xC2' && static_cast<unsigned char>(text[1]) < 0xA0;
    result += length == 0 || control ? "?" : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

std::string quoted(std::string_view text) { return "'" + printable(text) + "'"; }

std::string alternatives(std::span<const std::string_view> items) {
  std::string result;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) result += i + 1 == items.size() ? " or " : ", ";
    result += items[i];
  }
  return result;
}

std::string suggest(std::string_view text, std::span<const std::string_view> candidates) {
  if (const auto name = nearest(text, candidates); !name.empty())
    return fmt::format("did you mean '{}'?", name);
  return candidates.empty() ? "" : "permitted: " + alternatives(candidates);
}

}  // namespace axisd::config
