#include "buses/canopen/eds_values.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

namespace axisd::canopen {

namespace {

constexpr std::string_view node_id = "$nodeid";
constexpr std::string_view blanks = " \t\r\n\v\f";

std::optional<std::uint64_t> parse_magnitude(std::string_view text) {
  int base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    base = 16;
    text.remove_prefix(2);
  } else if (text.size() > 1 && text.front() == '0') {
    base = 8;
    text.remove_prefix(1);
  }
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Hexadecimal digits only, `least` to `most` of them.
std::optional<unsigned> parse_hex(std::string_view text, std::size_t least, std::size_t most) {
  unsigned value = 0;
  if (text.size() < least || text.size() > most) return std::nullopt;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (auto& letter : lower)
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  return lower;
}

std::string printable(std::string_view text) {
  constexpr std::size_t longest = 240;
  std::string shown(text.substr(0, longest));
  std::ranges::replace_if(shown, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text.size() > longest ? shown + "..." : shown;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  const auto magnitude = parse_magnitude(text);
  if (!magnitude) return std::nullopt;
  constexpr auto most_negative = std::uint64_t{1} << 63U;
  if (negative && *magnitude > most_negative) return std::nullopt;
  return static_cast<std::int64_t>(negative ? 0 - *magnitude : *magnitude);
}

std::optional<EdsNumber> parse_number(std::string_view text) {
  const auto lower = lower_case(trimmed(text));
  const auto at = lower.find(node_id);
  if (at == std::string::npos) {
    const auto value = parse_integer(lower);
    return value ? std::optional(EdsNumber{.value = *value}) : std::nullopt;
  }
  auto before = trimmed(std::string_view(lower).substr(0, at));
  auto after = trimmed(std::string_view(lower).substr(at + node_id.size()));
  if (before.empty() && after.empty()) return EdsNumber{.plus_node_id = true};
  if (before.empty() == after.empty()) return std::nullopt;
  std::string_view constant;
  if (after.starts_with('+'))
    constant = trimmed(after.substr(1));
  else if (before.ends_with('+'))
    constant = trimmed(before.substr(0, before.size() - 1));
  const auto value = constant.empty() ? std::nullopt : parse_magnitude(constant);
  // No identifier is that large, and a sum with the node-ID must not overflow.
  if (!value || *value > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return EdsNumber{.value = static_cast<std::int64_t>(*value), .plus_node_id = true};
}

std::optional<EdsNumber> parse_number(std::string_view text, DataType type) {
  auto number = parse_number(text);
  const auto [kind, bits] = info(type);
  if (!number || bits == 0 || bits >= 64) return number;
  const auto range = std::int64_t{1} << bits;
  if (kind == TypeInfo::Kind::integer) {
    if (number->value < -(range / 2) || number->value >= range) return std::nullopt;
    number->value = sign_extended(static_cast<std::uint64_t>(number->value), bits);
  } else if (number->value < 0 || number->value >= range) {
    return std::nullopt;
  }
  return number;
}

std::optional<double> parse_real(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Access> parse_access(std::string_view text) {
  static constexpr std::array<std::pair<std::string_view, Access>, 6> names{
      {{"ro", Access::read_only},
       {"wo", Access::write_only},
       {"rw", Access::read_write},
       {"rwr", Access::read_write_input},
       {"rww", Access::read_write_output},
       {"const", Access::constant}}};
  const auto lower = lower_case(text);
  for (const auto& [name, access] : names)
    if (lower == name) return access;
  return std::nullopt;
}

std::optional<ObjectSection> parse_object_section(std::string_view name) {
  const auto lower = lower_case(name);
  const auto at = lower.find("sub");
  const auto index = parse_hex(std::string_view(lower).substr(0, at), 4, 4);
  if (!index) return std::nullopt;
  ObjectSection section{.object = {.index = static_cast<std::uint16_t>(*index)}};
  if (at == std::string::npos) return section;
  const auto sub = parse_hex(std::string_view(lower).substr(at + 3), 1, 2);
  if (!sub) return std::nullopt;
  section.object.sub = static_cast<std::uint8_t>(*sub);
  section.has_sub = true;
  return section;
}

}  // namespace axisd::canopen
