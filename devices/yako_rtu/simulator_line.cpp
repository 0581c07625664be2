#include "devices/yako_rtu/simulator_line.hpp"

#include <algorithm>
#include <array>

namespace axisd::yako_rtu {

namespace {

using simulation::Serial;

// Codes of 0x0015 (6.1).
constexpr std::array<modbus_rtu::Format, 4> formats{{{.parity = modbus_rtu::Parity::none, .stop_bits = 1},
                                                     {.parity = modbus_rtu::Parity::none, .stop_bits = 2},
                                                     {.parity = modbus_rtu::Parity::even, .stop_bits = 1},
                                                     {.parity = modbus_rtu::Parity::odd, .stop_bits = 1}}};

}  // namespace

LineSetup::LineSetup(const SimulatedModel& model, const Behaviour& behaviour,
                     const simulation::SimulatedNodeSettings& settings)
    : model_(&model),
      behaviour_(&behaviour),
      settings_(&settings),
      node_(settings.address),
      dip_baud_(settings.dip_baud) {}

void LineSetup::power_up(const Memory& memory) {
  const auto custom = memory.get(reg::custom_node);
  const bool defined = custom >= model_->first_custom_address && custom <= model_->last_custom_address;
  const std::uint8_t fallback =
      behaviour_->undefined_address_is_1 ? std::uint8_t{1} : model_->undefined_custom_address;
  node_ = *settings_->dip_address != 0 ? *settings_->dip_address
          : defined                    ? static_cast<std::uint8_t>(custom)
                                       : fallback;
  set_serial(memory);
}

/// 6.1: 0x0014 and 0x0015 count from the next power-up; 4.4: the switches before 0x0014.
void LineSetup::set_serial(const Memory& memory) {
  if (!dip_baud_) return;
  const auto custom = model_->custom_bauds.at(memory.get(reg::custom_baud) & 3U);
  serial_ = Serial{.baud = *dip_baud_ != 0 ? *dip_baud_ : custom,
                   .format = formats.at(memory.get(reg::serial_format) & 3U)};
}

void LineSetup::join(const Serial& line, Memory& memory) {
  if (settings_->dip_baud) return;
  dip_baud_ = std::ranges::find(model_->dip_bauds, line.baud) != model_->dip_bauds.end() ? line.baud : 0;
  const auto preset = [&](std::uint16_t address, auto index) {
    if (index < 4 && !settings_->eeprom.contains(address))
      memory.preset(address, static_cast<std::uint16_t>(index));
  };
  if (*dip_baud_ == 0)
    preset(reg::custom_baud,
           std::ranges::find(model_->custom_bauds, line.baud) - model_->custom_bauds.begin());
  preset(reg::serial_format, std::ranges::find_if(formats, [&](const modbus_rtu::Format& one) {
                               return one.parity == line.format.parity &&
                                      one.stop_bits == line.format.stop_bits;
                             }) - formats.begin());
  set_serial(memory);
}

}  // namespace axisd::yako_rtu
