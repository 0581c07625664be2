// The object dictionary of a simulated CANopen node: rows, values in RAM and what the EEPROM holds.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string_view>

#include "devices/descriptor.hpp"

namespace axisd::simulation {

/// Abort codes of CiA 301, 7.2.4.3.17, kept apart from the master's own table so that an error there shows.
namespace abort_code {
inline constexpr std::uint32_t none = 0, toggle = 0x05030000, bad_command = 0x05040001,
                               unsupported = 0x06010000, write_only = 0x06010001, read_only = 0x06010002,
                               no_object = 0x06020000, not_mappable = 0x06040041, pdo_length = 0x06040042,
                               size_differs = 0x06070010, too_long = 0x06070012, too_short = 0x06070013,
                               no_sub_index = 0x06090011, value = 0x06090030, general = 0x08000000,
                               device_state = 0x08000022;
}  // namespace abort_code

/// One entry of the dictionary.
struct ObjectRow {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint8_t size = 2;  ///< bytes: 1 to 8
  bool is_signed = false;
  Access access = Access::ro;
  std::int64_t minimum = 0, maximum = 0;  ///< of a write
  std::int64_t default_value = 0;
  bool mappable = false;
  std::string_view text{};  ///< a visible string instead of a number (read-only); outlives the dictionary

  [[nodiscard]] std::uint32_t key() const { return std::uint32_t{index} << 8U | sub; }
};

/// index << 8 | sub.
constexpr std::uint32_t object_key(std::uint16_t index, std::uint8_t sub = 0) {
  return std::uint32_t{index} << 8U | sub;
}
/// `size` bytes, low byte first, as the number that a row holds.
std::int64_t decode(const ObjectRow& row, std::span<const std::uint8_t> bytes);

class CanopenDictionary {
 public:
  /// A row that was there before is replaced, its value too.
  void add(const ObjectRow& row);
  [[nodiscard]] const ObjectRow* find(std::uint16_t index, std::uint8_t sub) const;
  /// no_object or no_sub_index.
  [[nodiscard]] std::uint32_t missing(std::uint16_t index) const;

  /// What is in RAM; 0 for what does not exist.
  [[nodiscard]] std::int64_t get(std::uint16_t index, std::uint8_t sub = 0) const;
  /// Into RAM, past all rules; bits beyond the object's size are dropped. Ignored for what does not exist.
  void set(std::uint16_t index, std::uint8_t sub, std::int64_t value);
  /// RAM and EEPROM, not counted: as somebody left it.
  void preset(std::uint32_t key, std::int64_t value);

  /// What a write of `value` to `row` would get from the table alone.
  [[nodiscard]] static std::uint32_t check_write(const ObjectRow& row, std::int64_t value);
  /// A write over the network: RAM, and the EEPROM as well if `saves`.
  void write(const ObjectRow& row, std::int64_t value, bool saves);
  /// RAM becomes what the EEPROM holds, from `first` to `last` (indices).
  void power_up(std::uint16_t first = 0, std::uint16_t last = 0xFFFF);
  /// EEPROM and RAM become as from the factory (what can be written), or the EEPROM as RAM; each entry
  /// counts.
  void restore_factory();
  void save_all();
  [[nodiscard]] std::uint64_t eeprom_writes() const { return writes_; }

 private:
  struct Entry {
    ObjectRow row;
    std::int64_t ram = 0, eeprom = 0;
  };
  [[nodiscard]] static bool can_be_saved(const ObjectRow& row) {
    return row.access == Access::rw || row.access == Access::rw_saved;
  }
  std::map<std::uint32_t, Entry> entries_;
  std::uint64_t writes_ = 0;
};

}  // namespace axisd::simulation
