#include "devices/simulation/canopen_dictionary.hpp"

namespace axisd::simulation {

namespace {

/// The low bits of `value` as the number that an object of the row's type holds.
std::int64_t cut_to_size(const ObjectRow& row, std::int64_t value) {
  const unsigned bits = row.size * 8U;
  auto raw = static_cast<std::uint64_t>(value);
  if (bits < 64) raw &= (std::uint64_t{1} << bits) - 1;
  if (bits < 64 && row.is_signed && (raw >> (bits - 1) & 1U) != 0)
    return static_cast<std::int64_t>(raw) - (std::int64_t{1} << bits);
  return static_cast<std::int64_t>(raw);
}

}  // namespace

std::int64_t decode(const ObjectRow& row, std::span<const std::uint8_t> bytes) {
  std::uint64_t raw = 0;
  for (std::size_t i = 0; i < bytes.size() && i < 8; ++i) raw |= std::uint64_t{bytes[i]} << (8 * i);
  return cut_to_size(row, static_cast<std::int64_t>(raw));
}

void CanopenDictionary::add(const ObjectRow& row) {
  entries_[row.key()] = {.row = row, .ram = row.default_value, .eeprom = row.default_value};
}

const ObjectRow* CanopenDictionary::find(std::uint16_t index, std::uint8_t sub) const {
  const auto found = entries_.find(object_key(index, sub));
  return found == entries_.end() ? nullptr : &found->second.row;
}

std::uint32_t CanopenDictionary::missing(std::uint16_t index) const {
  const auto first = entries_.lower_bound(object_key(index));
  const bool known = first != entries_.end() && first->second.row.index == index;
  return known ? abort_code::no_sub_index : abort_code::no_object;
}

std::int64_t CanopenDictionary::get(std::uint16_t index, std::uint8_t sub) const {
  const auto found = entries_.find(object_key(index, sub));
  return found == entries_.end() ? 0 : found->second.ram;
}

void CanopenDictionary::set(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
  const auto found = entries_.find(object_key(index, sub));
  if (found != entries_.end()) found->second.ram = cut_to_size(found->second.row, value);
}

void CanopenDictionary::preset(std::uint32_t key, std::int64_t value) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return;
  found->second.ram = found->second.eeprom = cut_to_size(found->second.row, value);
}

std::uint32_t CanopenDictionary::check_write(const ObjectRow& row, std::int64_t value) {
  if (row.access == Access::ro || !row.text.empty()) return abort_code::read_only;
  return value < row.minimum || value > row.maximum ? abort_code::value : abort_code::none;
}

void CanopenDictionary::write(const ObjectRow& row, std::int64_t value, bool saves) {
  auto& entry = entries_.at(row.key());
  entry.ram = value;
  if (!saves) return;
  entry.eeprom = value;
  ++writes_;
}

void CanopenDictionary::power_up(std::uint16_t first, std::uint16_t last) {
  for (auto& [key, entry] : entries_)
    if (entry.row.index >= first && entry.row.index <= last) entry.ram = entry.eeprom;
}

void CanopenDictionary::restore_factory() {
  for (auto& [key, entry] : entries_) {
    if (!can_be_saved(entry.row)) continue;
    entry.ram = entry.eeprom = entry.row.default_value;
    ++writes_;
  }
}

void CanopenDictionary::save_all() {
  for (auto& [key, entry] : entries_) {
    if (!can_be_saved(entry.row)) continue;
    entry.eeprom = entry.ram;
    ++writes_;
  }
}

}  // namespace axisd::simulation
