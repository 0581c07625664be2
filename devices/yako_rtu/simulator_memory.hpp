// Registers and EEPROM of the simulated drive: addresses, ranges, attributes (manual 6.1, 6.2.4).
#pragma once

#include <array>
#include <cstdint>
#include <map>

#include "devices/yako_rtu/registers.hpp"
#include "devices/yako_rtu/simulator_switches.hpp"

namespace axisd::yako_rtu {

/// The vendor's exception codes (table at the end of 6.2.4), not those of the Modbus standard.
enum class Fail : std::uint8_t {
  none = 0,
  crc = 1,
  function = 2,
  address = 3,
  beyond = 4,
  count = 5,
  access = 6,
  value = 7
};

class Memory {
 public:
  /// `eeprom` holds what differs from the factory's settings.
  Memory(const Behaviour& behaviour, const std::map<std::uint16_t, std::uint16_t>& eeprom);

  /// RAM becomes what the EEPROM holds.
  void power_up() { ram_ = eeprom_; }
  /// May `count` registers from `address` be read, or may `value` be written to `address`?
  [[nodiscard]] static Fail check_read(std::uint32_t address, std::uint32_t count);
  [[nodiscard]] static Fail check_write(std::uint32_t address, std::uint16_t value);

  [[nodiscard]] std::uint16_t get(std::uint16_t address) const { return ram_.at(address); }
  /// The value as the signed 16-bit number that some registers hold.
  [[nodiscard]] int get_signed(std::uint16_t address) const {
    return static_cast<std::int16_t>(get(address));
  }
  /// A signed 32-bit number in two words that need not be neighbours.
  [[nodiscard]] std::int32_t get_long(std::uint16_t high, std::uint16_t low) const;
  [[nodiscard]] int pulses_per_revolution() const;

  /// A write over the bus: RW/S goes to EEPROM as well while 0x0016 = 0.
  void write(std::uint16_t address, std::uint16_t value);
  /// Past all rules, RAM only.
  void poke(std::uint16_t address, std::uint16_t value) { ram_.at(address) = value; }
  void restore_factory();
  void save_all();
  [[nodiscard]] std::uint64_t eeprom_writes() const { return writes_; }

 private:
  using Image = std::array<std::uint16_t, reg::last + 1>;
  [[nodiscard]] bool goes_to_eeprom(std::uint16_t address) const;

  const Behaviour* behaviour_;
  Image ram_{}, eeprom_{};
  std::uint64_t writes_ = 0;
};

}  // namespace axisd::yako_rtu
