#include "devices/cia402_eds/overrides.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <utility>

namespace axisd::cia402_eds {

namespace {

using canopen::DataType;
using canopen::EdsPart;
using canopen::Object;

constexpr std::string_view prefix = "objects.";

/// "6084h:00".
std::optional<Object> object_of(std::string_view text) {
  constexpr std::size_t length = 8, sub_at = 6, index_digits = 4, sub_digits = 2;
  if (text.size() != length) return std::nullopt;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  const auto* first = text.data();
  if (std::from_chars(first, first + index_digits, index, 16).ec != std::errc{}) return std::nullopt;
  first += sub_at;
  if (std::from_chars(first, first + sub_digits, sub, 16).ec != std::errc{}) return std::nullopt;
  return Object{index, sub};
}

std::optional<DataType> type_of(std::string_view name) {
  static constexpr auto names = std::to_array<std::pair<std::string_view, DataType>>({
      {"u8", DataType::unsigned8},
      {"i8", DataType::integer8},
      {"u16", DataType::unsigned16},
      {"i16", DataType::integer16},
      {"u32", DataType::unsigned32},
      {"i32", DataType::integer32},
  });
  for (const auto& [known, type] : names)
    if (known == name) return type;
  return std::nullopt;
}

void set(Override& one, std::string_view key, const SettingValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  const auto* number = std::get_if<std::int64_t>(&value);
  const auto* flag = std::get_if<bool>(&value);
  if (key == "type" && text != nullptr) one.type = type_of(*text);
  if (key == "access" && text != nullptr) {
    one.absent = *text == "none";
    if (*text == "ro") one.access = canopen::Access::read_only;
    if (*text == "wo") one.access = canopen::Access::write_only;
    if (*text == "rw") one.access = canopen::Access::read_write;
  }
  if (key == "minimum" && number != nullptr) one.low = *number;
  if (key == "maximum" && number != nullptr) one.high = *number;
  if (key == "default" && number != nullptr) one.value = *number;
  if (key == "pdo" && flag != nullptr) one.mappable = *flag;
}

bool fits(std::int64_t value, DataType type) {
  const auto [kind, bits] = canopen::info(type);
  if (bits == 0 || bits >= 64) return true;
  const bool is_signed = kind == canopen::TypeInfo::Kind::integer;
  const auto most = std::int64_t{1} << (is_signed ? bits - 1 : bits);
  return value >= (is_signed ? -most : 0) && value < most;
}

/// One object as the configuration has it.
class Change {
 public:
  Change(canopen::EdsObject& entry, std::vector<std::string>& problems)
      : entry_(&entry), problems_(&problems) {}
  void make(const Override& by) {
    if (by.type && *by.type != entry_->type) {
      entry_->type = *by.type;
      for (auto* number : {&entry_->low, &entry_->high, &entry_->initial, &entry_->configured})
        if (*number && !fits((*number)->value, entry_->type)) number->reset();
    }
    if (by.access) entry_->access = *by.access;
    if (by.mappable) entry_->mappable = *by.mappable;
    set("minimum", by.low, entry_->low);
    set("maximum", by.high, entry_->high);
    set("default", by.value, entry_->initial);
    if (by.value) entry_->configured.reset();
    if (entry_->low && entry_->high && entry_->low->value > entry_->high->value)
      problem(fmt::format("its minimum {} is above its maximum {}", entry_->low->value, entry_->high->value));
  }

 private:
  void problem(std::string_view what) {
    problems_->push_back(fmt::format("drive.objects, {}: {}", to_string(entry_->object), what));
  }
  void set(std::string_view key, const std::optional<std::int64_t>& to,
           std::optional<canopen::EdsNumber>& of) {
    if (!to) return;
    if (fits(*to, entry_->type))
      of = canopen::EdsNumber{.value = *to};
    else
      problem(fmt::format("its type cannot hold '{}' {}", key, *to));
  }

  canopen::EdsObject* entry_;
  std::vector<std::string>* problems_;
};

}  // namespace

bool Override::has(EdsPart part) const {
  switch (part) {
    case EdsPart::none:
      break;
    case EdsPart::type:
      return absent || type.has_value();
    case EdsPart::access:
      return absent || access.has_value();
    case EdsPart::low:
      return absent || low.has_value();
    case EdsPart::high:
      return absent || high.has_value();
    case EdsPart::value:
      return absent || value.has_value();
    case EdsPart::mapping:
      return absent || mappable.has_value();
  }
  return false;
}

Overrides overrides_of(const std::map<std::string, SettingValue>& settings) {
  Overrides all;
  for (const auto& [name, value] : settings) {
    std::string_view rest = name;
    if (!rest.starts_with(prefix)) continue;
    rest.remove_prefix(prefix.size());
    const auto dot = rest.find('.');
    const auto object = object_of(rest.substr(0, dot));
    if (object && dot != std::string_view::npos) set(all[*object], rest.substr(dot + 1), value);
  }
  return all;
}

std::vector<std::string> apply_overrides(const Overrides& overrides, canopen::Eds& eds) {
  std::vector<std::string> problems;
  for (const auto& [object, by] : overrides) {
    if (by.absent) {
      eds.objects.erase(object);
      continue;
    }
    const bool described = eds.objects.contains(object);
    if (!described && (!by.type || !by.access)) {
      problems.push_back(
          fmt::format("drive.objects, {}: the file does not describe it: it needs 'type' and 'access'",
                      to_string(object)));
      continue;
    }
    if (!described)
      eds.objects.try_emplace(
          object, canopen::EdsObject{.object = object, .name = fmt::format("Object {}", to_string(object))});
    Change(eds.objects.at(object), problems).make(by);
  }
  return problems;
}

}  // namespace axisd::cia402_eds
