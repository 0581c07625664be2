#include "devices/yako_rtu/simulator_memory.hpp"

#include <algorithm>

#include "devices/ykd2405pr/parameters.hpp"

namespace axisd::yako_rtu {

namespace {

const ParameterSpec* find_register(std::uint32_t address) {
  static const auto by_address = [] {
    std::array<const ParameterSpec*, reg::last + 1> all{};
    for (const auto& parameter : ykd2405pr::parameters()) all.at(parameter.address) = &parameter;
    return all;
  }();
  return address < by_address.size() ? by_address[address] : nullptr;
}

/// Above the last register it is "beyond the range" (04), in a hole "not allowed" (03): 6.2.4.
Fail missing(std::uint32_t address) { return address > reg::last ? Fail::beyond : Fail::address; }

}  // namespace

Memory::Memory(const Behaviour& behaviour, const std::map<std::uint16_t, std::uint16_t>& eeprom)
    : behaviour_(&behaviour) {
  for (const auto& parameter : ykd2405pr::parameters())
    eeprom_.at(parameter.address) = static_cast<std::uint16_t>(parameter.default_value.value_or(0));
  for (const auto& [address, value] : eeprom) eeprom_.at(address) = value;
  power_up();
}

Fail Memory::check_read(std::uint32_t address, std::uint32_t count) {
  if (count < 1 || count > 16)
    return Fail::count;  // before all else: the example of 6.2.4 crosses a hole, too
  for (auto at = address; at < address + count; ++at) {
    const auto* parameter = find_register(at);
    if (parameter == nullptr) return missing(at);
    if (parameter->access == Access::wo) return Fail::access;
  }
  return Fail::none;
}

Fail Memory::check_write(std::uint32_t address, std::uint16_t value) {
  const auto* parameter = find_register(address);
  if (parameter == nullptr) return missing(address);
  if (parameter->access == Access::ro) return Fail::access;
  const auto within = [&](std::int32_t number) {
    return number >= parameter->minimum && number <= parameter->maximum;
  };
  const bool as_signed = parameter->minimum < 0 && within(static_cast<std::int16_t>(value));
  return as_signed || within(value) ? Fail::none : Fail::value;
}

std::int32_t Memory::get_long(std::uint16_t high, std::uint16_t low) const {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(get(high)) << 16U | get(low));
}

int Memory::pulses_per_revolution() const {
  static constexpr std::array<int, 16> table{200,  400,  800,  1600, 3200, 6400,  12800, 25600,
                                             1000, 2000, 4000, 5000, 8000, 10000, 20000, 40000};
  return table.at(get(reg::microstep) & 0x0FU);
}

bool Memory::goes_to_eeprom(std::uint16_t address) const {
  if (find_register(address)->access != Access::rw_saved) return false;
  if (address == reg::eeprom_update && behaviour_->eeprom_switch_saves_itself) return true;
  if (behaviour_->pv_speeds_always_saved && address >= reg::segment_pv_speed &&
      address < reg::segment_pv_speed + 16)
    return true;
  return get(reg::eeprom_update) == 0;
}

void Memory::write(std::uint16_t address, std::uint16_t value) {
  ram_.at(address) = value;
  if (!goes_to_eeprom(address)) return;
  eeprom_.at(address) = value;
  ++writes_;
}

void Memory::restore_factory() {
  for (const auto& parameter : ykd2405pr::parameters()) {
    if (parameter.access != Access::rw && parameter.access != Access::rw_saved) continue;
    eeprom_.at(parameter.address) = static_cast<std::uint16_t>(parameter.default_value.value_or(0));
    ++writes_;
  }
  ram_ = eeprom_;
}

void Memory::save_all() {
  for (const auto& parameter : ykd2405pr::parameters()) {
    if (parameter.access != Access::rw && parameter.access != Access::rw_saved) continue;
    eeprom_.at(parameter.address) = ram_.at(parameter.address);
    ++writes_;
  }
}

}  // namespace axisd::yako_rtu
