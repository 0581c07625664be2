// What the objects of the simulated drive say, and what writing them does (chapter 7).
#include <algorithm>
#include <array>
#include <cmath>

#include "devices/yss_c/simulator.hpp"
#include "devices/yss_c/simulator_rates.hpp"

namespace axisd::yss_c {

namespace abort_code = simulation::abort_code;
using simulation::ObjectRow;

simulation::CanopenHooks SimulatedDrive::hooks() {
  return {
      .read = [this](const ObjectRow& row) { return read(row); },
      .write = [this](const ObjectRow& row, std::int64_t value,
                      bool& store) { return write(row, value, store); },
      .written = [this](const ObjectRow& row) { written(row); },
      .saves = [this](const ObjectRow& row) { return saves(row); },
      .changing = [this] { return motor().moving() || (closed_loop() && shaft_.encoder().wavers(motor())); }};
}

std::int32_t SimulatedDrive::position() const {
  return shows_encoder() ? shaft_.measured(now_) : motor().counter();
}

/// 2002h: measured, where there is something to measure with.
std::int64_t SimulatedDrive::velocity_rpm() const {
  const bool measured = shows_encoder() && motor().following();
  const auto speed = measured ? motor().shaft_speed() : motor().direction() * motor().speed();
  const auto noise = shows_encoder() ? shaft_.encoder().velocity_noise(now_) : 0;
  return std::lround(speed * 60 / pulses_per_revolution(dictionary_)) + noise;
}

std::optional<std::int64_t> SimulatedDrive::read(const ObjectRow& row) const {
  switch (row.index) {
    case 0x2000:
      return server_.node();
    case 0x2001:
      return motor().moving() ? 1 : 0;
    case 0x2002:
      return velocity_rpm();
    case 0x2003:
      return shown(inputs_.bits(), 0x01, 7);
    case 0x2004:
      return shown(outputs(), 0x0C, 3);
    case 0x603F:
      return alarm_.on() ? 0xFF00 + alarm_.shown() : 0;
    case 0x6041:
      return status();
    case 0x6061:
      return control_.mode();
    case 0x6064:
      return position();
    default:
      return std::nullopt;
  }
}

std::uint32_t SimulatedDrive::write(const ObjectRow& row, std::int64_t value, bool& store) {
  if (row.access == Access::wo) {
    store = false;
    return command(row.index, value);
  }
  if (row.index == 0x6060 && value != 0 && value != 1 && value != 3 && value != 6) return abort_code::value;
  if (row.index == 0x60FF) velocity_.release();
  if (row.index == 0x6064) {
    if (motor().moving()) return abort_code::device_state;
    motor().set_counter(static_cast<std::int32_t>(value + (motor().counter() - position())));
    store = false;
  }
  if (row.index != 0x6098) return abort_code::none;
  const bool cia = value == 17 || value == 18 || value == 24 || value == 29;
  const bool taken = (cia && behaviour_.homing_codes_cia) || (value <= 3 && behaviour_.homing_codes_0_to_3);
  return taken ? abort_code::none : abort_code::value;
}

std::uint32_t SimulatedDrive::command(std::uint16_t index, std::int64_t value) {
  if (value == 0 && index != 0x200F) return abort_code::none;
  switch (index) {
    case 0x200F:
      value == 1 ? energise() : release();
      break;
    case 0x2010:
      value == 1 ? dictionary_.restore_factory() : dictionary_.save_all();
      if (value == 1) settle_inputs();
      break;
    case 0x2011:
      reset_fault();
      break;
    default:  // 2012h
      if (!motor().moving() || behaviour_.position_clear_in_motion) {
        if (behaviour_.position_clear_late)
          shaft_.clear_at(now_ + std::chrono::milliseconds(20));
        else
          motor().clear_counter();
      }
      break;
  }
  return abort_code::none;
}

void SimulatedDrive::written(const ObjectRow& row) {
  if (row.index == 0x6040) control(static_cast<std::uint16_t>(dictionary_.get(0x6040)));
  if (row.index == 0x6060) set_mode(static_cast<int>(dictionary_.get(0x6060)));
  if (row.index == 0x2030 && row.sub <= 8 && !behaviour_.configuration_makes_edges) settle_inputs();
}

/// 200Ch, which RAM holds already.
bool SimulatedDrive::saves(const ObjectRow& row) const {
  return dictionary_.get(0x200C) == 0 || (row.index == 0x200C && behaviour_.eeprom_switch_saves_itself);
}

}  // namespace axisd::yss_c
