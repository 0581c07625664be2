#include "buses/canopen/eds_values.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

namespace axisd::canopen {

namespace {

constexpr std::string_view blanks = " \t\r\n\v\f";

std::optional<std::uint64_t> parse_magnitude(std::string_view text) {
  int base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    base = 16;
    text.remove_prefix(2);
  } else if (text.size() > 1 && text.front() == '0') {
    base = text.find_first_of("89") == std::string_view::npos ? 8 : 10;
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

/// Letters and digits alone tell: "Read/Write", "VISIBLE_STRING".
template <class Meaning, std::size_t count>
std::optional<Meaning> named(const std::array<std::pair<std::string_view, Meaning>, count>& names,
                             std::string_view text) {
  auto plain = lower_case(text);
  std::erase_if(plain, [](char c) { return !(c >= 'a' && c <= 'z') && !(c >= '0' && c <= '9'); });
  const auto found = std::ranges::find(names, plain, [](const auto& one) { return one.first; });
  return found == names.end() ? std::nullopt : std::optional(found->second);
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
  auto rest = trimmed(text);
  if (const auto alone = parse_integer(rest)) return EdsNumber{.value = *alone};
  EdsNumber sum;
  for (bool last = false; !last;) {
    const auto end = rest.find('+');
    last = end == std::string_view::npos;
    const auto term = lower_case(trimmed(rest.substr(0, end)));
    if (!last) rest.remove_prefix(end + 1);
    if (term == "$nodeid" || term == "nodeid") {
      if (std::exchange(sum.plus_node_id, true)) return std::nullopt;
      continue;
    }
    const auto value = parse_magnitude(term);
    // No identifier is that large, and a sum with the node-ID must not overflow.
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    if (!value || *value > most) return std::nullopt;
    sum.value += static_cast<std::int64_t>(*value);
    if (sum.value > static_cast<std::int64_t>(most)) return std::nullopt;
  }
  return sum;
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
  static constexpr auto names =
      std::to_array<std::pair<std::string_view, Access>>({{"ro", Access::read_only},
                                                          {"r", Access::read_only},
                                                          {"read", Access::read_only},
                                                          {"readonly", Access::read_only},
                                                          {"wo", Access::write_only},
                                                          {"w", Access::write_only},
                                                          {"write", Access::write_only},
                                                          {"writeonly", Access::write_only},
                                                          {"rw", Access::read_write},
                                                          {"wr", Access::read_write},
                                                          {"readwrite", Access::read_write},
                                                          {"rwr", Access::read_write_input},
                                                          {"rww", Access::read_write_output},
                                                          {"const", Access::constant},
                                                          {"constant", Access::constant}});
  return named(names, text);
}

std::optional<ObjectKind> parse_object_kind(std::string_view text) {
  static constexpr auto names =
      std::to_array<std::pair<std::string_view, ObjectKind>>({{"null", ObjectKind::null},
                                                              {"domain", ObjectKind::domain},
                                                              {"deftype", ObjectKind::type_definition},
                                                              {"defstruct", ObjectKind::type_definition},
                                                              {"var", ObjectKind::variable},
                                                              {"variable", ObjectKind::variable},
                                                              {"array", ObjectKind::composed},
                                                              {"rec", ObjectKind::composed},
                                                              {"record", ObjectKind::composed}});
  // CiA 301, table 42; from 5 on in this order.
  static constexpr std::array numbered{ObjectKind::type_definition, ObjectKind::type_definition,
                                       ObjectKind::variable, ObjectKind::composed, ObjectKind::composed};
  constexpr std::int64_t domain = 2, first = 5;
  const auto code = parse_integer(trimmed(text));
  if (!code) return named(names, text);
  if (*code == 0) return ObjectKind::null;
  if (*code == domain) return ObjectKind::domain;
  const auto at = *code - first;
  if (at < 0 || at >= std::ssize(numbered)) return std::nullopt;
  return numbered.at(static_cast<std::size_t>(at));
}

std::optional<DataType> parse_data_type(std::string_view text) {
  static constexpr auto names =
      std::to_array<std::pair<std::string_view, DataType>>({{"boolean", DataType::boolean},
                                                            {"integer8", DataType::integer8},
                                                            {"integer16", DataType::integer16},
                                                            {"integer24", DataType::integer24},
                                                            {"integer32", DataType::integer32},
                                                            {"integer64", DataType::integer64},
                                                            {"unsigned8", DataType::unsigned8},
                                                            {"unsigned16", DataType::unsigned16},
                                                            {"unsigned24", DataType::unsigned24},
                                                            {"unsigned32", DataType::unsigned32},
                                                            {"unsigned64", DataType::unsigned64},
                                                            {"real32", DataType::real32},
                                                            {"real64", DataType::real64},
                                                            {"visiblestring", DataType::visible_string},
                                                            {"octetstring", DataType::octet_string},
                                                            {"unicodestring", DataType::unicode_string},
                                                            {"timeofday", DataType::time_of_day},
                                                            {"timedifference", DataType::time_difference},
                                                            {"domain", DataType::domain}});
  constexpr std::int64_t most = 0xFFFF;
  const auto code = parse_integer(trimmed(text));
  if (!code) return named(names, text);
  if (*code <= 0 || *code > most) return std::nullopt;
  return static_cast<DataType>(*code);
}

std::optional<bool> parse_flag(std::string_view text) {
  static constexpr auto names = std::to_array<std::pair<std::string_view, bool>>(
      {{"no", false}, {"false", false}, {"yes", true}, {"true", true}});
  const auto code = parse_integer(trimmed(text));
  if (!code) return named(names, text);
  return *code == 0 || *code == 1 ? std::optional(*code == 1) : std::nullopt;
}

std::optional<ObjectSection> parse_object_section(std::string_view name) {
  auto lower = lower_case(name);
  std::erase_if(lower, [](char c) { return blanks.contains(c); });
  if (lower.starts_with("0x")) lower.erase(0, 2);
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
