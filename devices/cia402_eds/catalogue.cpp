#include "devices/cia402_eds/catalogue.hpp"

#include <fmt/format.h>

#include <map>
#include <optional>

namespace axisd::cia402_eds {

namespace {

using canopen::DataType;

std::optional<ParameterType> type_of(DataType type) {
  switch (type) {
    case DataType::boolean:
    case DataType::unsigned8:
      return ParameterType::u8;
    case DataType::integer8:
      return ParameterType::i8;
    case DataType::unsigned16:
      return ParameterType::u16;
    case DataType::integer16:
      return ParameterType::i16;
    case DataType::unsigned32:
      return ParameterType::u32;
    case DataType::integer32:
      return ParameterType::i32;
    default:
      return std::nullopt;
  }
}

Access access_of(canopen::Access access) {
  if (!canopen::readable(access)) return Access::wo;
  return canopen::writable(access) ? Access::rw : Access::ro;
}

/// Of all values that the type can hold.
std::pair<std::int64_t, std::int64_t> range_of(ParameterType type) {
  const auto bits = 8 * static_cast<unsigned>(size_of(type));
  const auto most = std::int64_t{1} << (is_signed(type) ? bits - 1 : bits);
  return {is_signed(type) ? -most : 0, most - 1};
}

/// "Profile velocity" -> "profile_velocity": letters, digits and single underscores, a letter first.
std::string snake_case(std::string_view name) {
  std::string text;
  for (const char c : name) {
    const bool upper = c >= 'A' && c <= 'Z', lower = c >= 'a' && c <= 'z', digit = c >= '0' && c <= '9';
    if (upper || lower || digit)
      text += upper ? static_cast<char>(c - 'A' + 'a') : c;
    else if (!text.empty() && text.back() != '_')
      text += '_';
  }
  while (text.ends_with('_')) text.pop_back();
  if (text.empty() || (text.front() >= '0' && text.front() <= '9')) text = "object_" + text;
  return text;
}

std::optional<std::int64_t> plain(const std::optional<canopen::EdsNumber>& number) {
  return number && !number->plus_node_id ? std::optional(number->value) : std::nullopt;
}

}  // namespace

Catalogue catalogue_of(const canopen::Eds& eds) {
  std::map<std::string, int> uses;
  for (const auto& [object, entry] : eds.objects)
    if (type_of(entry.type)) ++uses[snake_case(entry.name)];
  Catalogue all;
  for (const auto& [object, entry] : eds.objects) {
    const auto type = type_of(entry.type);
    if (!type) continue;
    auto name = snake_case(entry.name);
    if (uses[name] > 1) name += fmt::format("_{:04x}_{:02x}", object.index, object.sub);
    const auto [lowest, highest] = range_of(*type);
    const std::string_view unique = all.texts.emplace_back(std::move(name));
    all.rows.push_back({.address = object.key(),
                        .name = unique,
                        .access = access_of(entry.access),
                        .minimum = plain(entry.low).value_or(lowest),
                        .maximum = plain(entry.high).value_or(highest),
                        .default_value = plain(entry.initial),
                        .description = all.texts.emplace_back(entry.name),
                        .type = *type});
  }
  return all;
}

}  // namespace axisd::cia402_eds
