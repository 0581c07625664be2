// Registers and EEPROM of the simulated drive: addresses, ranges, attributes (manual 6.1, 6.2.4).
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "devices/simulation/profile.hpp"
#include "devices/yako_rtu/registers.hpp"
#include "devices/yako_rtu/simulator_model.hpp"
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
  Memory(const SimulatedModel& model, const Behaviour& behaviour,
         const std::map<std::uint32_t, std::uint32_t>& eeprom);

  /// RAM becomes what the EEPROM holds.
  void power_up();
  [[nodiscard]] std::uint16_t last() const { return model_->last; }
  /// Register with the function of the first input.
  [[nodiscard]] std::uint16_t first_input_function() const { return first_input_function_; }
  /// May `count` registers from `address` be read, or may `value` be written to `address`?
  [[nodiscard]] Fail check_read(std::uint32_t address, std::uint32_t count) const;
  [[nodiscard]] Fail check_write(std::uint32_t address, std::uint16_t value) const;

  [[nodiscard]] std::uint16_t get(std::uint16_t address) const { return ram_.at(address); }
  /// The value as the signed 16-bit number that some registers hold.
  [[nodiscard]] int get_signed(std::uint16_t address) const {
    return static_cast<std::int16_t>(get(address));
  }
  /// A signed 32-bit number in two words that need not be neighbours.
  [[nodiscard]] std::int32_t get_long(std::uint16_t high, std::uint16_t low) const;
  [[nodiscard]] int pulses_per_revolution() const;
  /// Of a motion with the start speed that is set now.
  [[nodiscard]] simulation::Rates rates(double rpm, double acceleration_ms, double deceleration_ms) const;

  /// A write over the bus: RW/S goes to EEPROM as well while 0x0016 = 0.
  void write(std::uint16_t address, std::uint16_t value);
  /// Past all rules, RAM only.
  void poke(std::uint16_t address, std::uint16_t value) { ram_.at(address) = value; }
  /// As somebody left it: RAM and EEPROM, not counted as a write.
  void preset(std::uint16_t address, std::uint16_t value) { ram_.at(address) = eeprom_.at(address) = value; }
  void restore_factory();
  void save_all();
  [[nodiscard]] std::uint64_t eeprom_writes() const { return writes_; }

 private:
  using Image = std::vector<std::uint16_t>;
  [[nodiscard]] const ParameterSpec* find(std::uint32_t address) const;
  /// Above the last register it is "beyond the range" (04), in a hole "not allowed" (03): 6.2.4.
  [[nodiscard]] Fail missing(std::uint32_t address) const;
  [[nodiscard]] bool goes_to_eeprom(std::uint16_t address) const;

  const SimulatedModel* model_;
  const Behaviour* behaviour_;
  std::uint16_t first_input_function_;
  std::vector<const ParameterSpec*> specs_;  ///< by address; nullptr: a hole
  Image ram_, eeprom_;
  std::uint64_t writes_ = 0;
};

}  // namespace axisd::yako_rtu
