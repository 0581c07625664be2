#include "devices/yako_rtu/simulator_memory.hpp"

#include <algorithm>

namespace axisd::yako_rtu {

namespace {

std::uint16_t factory_value(const ParameterSpec& parameter) {
  return static_cast<std::uint16_t>(parameter.default_value.value_or(0));
}

bool can_be_saved(const ParameterSpec* parameter) {
  return parameter != nullptr && (parameter->access == Access::rw || parameter->access == Access::rw_saved);
}

}  // namespace

Memory::Memory(const SimulatedModel& model, const Behaviour& behaviour,
               const std::map<std::uint32_t, std::uint32_t>& eeprom)
    : model_(&model),
      behaviour_(&behaviour),
      first_input_function_(behaviour.other_input_functions ? model.other_first_input_function
                                                            : model.first_input_function),
      specs_(model.last + std::size_t{1}),
      eeprom_(specs_.size()) {
  for (const auto& parameter : model.parameters()) {
    const auto input = parameter.address - model.first_input_function;
    const bool is_input = parameter.address >= model.first_input_function && input < model.inputs.size();
    const auto address = is_input ? first_input_function_ + input : parameter.address;
    specs_.at(address) = &parameter;
    eeprom_.at(address) = factory_value(parameter);
  }
  for (const auto& [address, value] : eeprom) eeprom_.at(address) = static_cast<std::uint16_t>(value);
  ram_ = eeprom_;
}

void Memory::power_up() {
  ram_ = eeprom_;
  if (!behaviour_->inputs_undefined_at_power_up) return;
  for (std::size_t i = 0; i < model_->inputs.size(); ++i) ram_.at(first_input_function_ + i) = 0;
}

const ParameterSpec* Memory::find(std::uint32_t address) const {
  return address < specs_.size() ? specs_[address] : nullptr;
}

Fail Memory::missing(std::uint32_t address) const {
  return address > model_->last ? Fail::beyond : Fail::address;
}

Fail Memory::check_read(std::uint32_t address, std::uint32_t count) const {
  if (count < 1 || count > 16)
    return Fail::count;  // before all else: the example of 6.2.4 crosses a hole, too
  for (auto at = address; at < address + count; ++at) {
    const auto* parameter = find(at);
    if (parameter == nullptr) return missing(at);
    if (parameter->access != Access::wo) continue;
    // The table prints RW for the commands but 0x0027, whose read 6.2.4 refuses.
    if (at == reg::start || !behaviour_->commands_readable) return Fail::access;
  }
  return Fail::none;
}

Fail Memory::check_write(std::uint32_t address, std::uint16_t value) const {
  const auto* parameter = find(address);
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
  return model_->pulses_per_revolution.at(get(reg::microstep) & 0x0FU);
}

simulation::Rates Memory::rates(double rpm, double acceleration_ms, double deceleration_ms) const {
  const double pulses = pulses_per_revolution();
  const double fastest = std::min(3000.0, 12e6 / pulses);  // 0x0023: 200 kHz of pulses
  return simulation::rates_from(get(reg::start_speed), std::min(rpm, fastest), acceleration_ms,
                                deceleration_ms, pulses);
}

bool Memory::goes_to_eeprom(std::uint16_t address) const {
  const bool saved = address == reg::overtravel_stop
                         ? model_->overtravel_saved || behaviour_->overtravel_stop_saved
                         : find(address)->access == Access::rw_saved;
  if (!saved) return false;
  if (address == reg::eeprom_update && behaviour_->eeprom_switch_saves_itself) return true;
  if (behaviour_->pv_speeds_always_saved && address >= reg::segment_pv_speed &&
      address < reg::segment_pv_speed + 16)
    return true;
  return get(reg::eeprom_update) == 0;
}

void Memory::write(std::uint16_t address, std::uint16_t value) {
  ram_.at(address) = value;
  if (!goes_to_eeprom(address)) return;
  eeprom_.at(address) = static_cast<std::uint16_t>(value);
  ++writes_;
}

void Memory::restore_factory() {
  for (std::size_t address = 0; address < specs_.size(); ++address) {
    if (!can_be_saved(specs_[address])) continue;
    eeprom_[address] = factory_value(*specs_[address]);
    ++writes_;
  }
  ram_ = eeprom_;
}

void Memory::save_all() {
  for (std::size_t address = 0; address < specs_.size(); ++address) {
    if (!can_be_saved(specs_[address])) continue;
    eeprom_[address] = ram_[address];
    ++writes_;
  }
}

}  // namespace axisd::yako_rtu
