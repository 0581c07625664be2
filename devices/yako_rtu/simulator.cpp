// Power, time and state of the simulated drive.
#include "devices/yako_rtu/simulator.hpp"

#include <algorithm>
#include <cmath>

namespace axisd::yako_rtu {

namespace {

simulation::SimulatedNodeSettings with_defaults(simulation::SimulatedNodeSettings settings,
                                                const Behaviour& behaviour) {
  if (behaviour.model_code_0302) settings.eeprom.try_emplace(reg::model, 0x0302);
  if (settings.address > 31) settings.eeprom.try_emplace(reg::custom_node, settings.address);
  return settings;
}

}  // namespace

SimulatedDrive::SimulatedDrive(simulation::SimulatedNodeSettings settings)
    : behaviour_(behaviour_from(settings.switches)),
      settings_(with_defaults(std::move(settings), behaviour_)),
      memory_(behaviour_, settings_.eeprom),
      terminals_(behaviour_, settings_) {
  node_ = settings_.address;
  if (!settings_.powered) return;
  power_up();
  boot_end_.reset();
}

void SimulatedDrive::power_up() {
  powered_ = true;
  boot_end_ = now_ + settings_.boot_time;
  memory_.power_up();
  motor_.power_up();
  // 4.4: the DIP switches give 1..31; all off, 0x0013 counts, and only its values above 31 are defined.
  const auto custom = memory_.get(reg::custom_node);
  node_ = settings_.address <= 31 ? settings_.address : static_cast<std::uint8_t>(custom > 31 ? custom : 0);
  control_mode_ = memory_.get(reg::control_mode);
  enabled_ = behaviour_.enabled_at_power_up;
  in_position_ = behaviour_.in_position_at_power_up;
  homed_ = false;
  alarm_ = cause_;
  activity_ = Activity::none;
  multi_speed_on_ = stopping_ = false;
  segment_due_ = TimePoint::max();
  terminals_.settle(motor_.shaft(), memory_);
}

void SimulatedDrive::set_power(bool on) {
  if (on == powered_) return;
  if (on) {
    power_up();
    return;
  }
  cut();
  powered_ = false;
  boot_end_.reset();
}

void SimulatedDrive::advance(TimePoint now) {
  now = std::max(now, now_);
  for (auto next = next_event(); next <= now; next = next_event()) step(std::max(next, now_));
  step(now);
}

TimePoint SimulatedDrive::next_event() const {
  if (!powered_) return TimePoint::max();
  if (boot_end_) return *boot_end_;
  auto next = std::min({motor_.ends(), terminals_.next_event(), segment_due_});
  if (motor_.moving()) {
    const auto change = terminals_.next_switch(motor_.shaft(), motor_.direction());
    if (change) next = std::min(next, motor_.reaches(*change));
  }
  return next;
}

void SimulatedDrive::step(TimePoint now) {
  now_ = now;
  const bool ended = motor_.advance(now);
  if (boot_end_ && now >= *boot_end_) {
    boot_end_.reset();
    terminals_.settle(motor_.shaft(), memory_);
  }
  if (!ready()) return;
  for (const auto& edge : terminals_.sample(now, motor_.shaft(), memory_)) on_edge(edge);
  if (motor_.moving() && !enabled()) cut();
  enforce_limits();
  if (ended && !motor_.moving()) on_stopped();
  if (segment_due_ <= now) start_segment();
  update_multi_speed();
}

void SimulatedDrive::set_input(std::string_view terminal, std::optional<bool> active) {
  terminals_.drive(terminal, active);
  step(now_);
}

bool SimulatedDrive::has_input(std::string_view terminal) const {
  return std::ranges::find(Terminals::names(), terminal, &TerminalSpec::name) != Terminals::names().end();
}

void SimulatedDrive::raise_alarm(int code) {
  if (code == 0) {
    cause_ = 0;
    if (alarm_ == 2 || alarm_ == 3) alarm_ = 0;  // chapter 8: these reset automatically
    return;
  }
  cause_ = code == 2 || code == 3 ? code : 0;
  if (!powered_) return;
  alarm_ = code;
  cut();
  if (behaviour_.alarm_releases) enabled_ = false;
}

void SimulatedDrive::clear_alarm() {
  if (alarm_ == 4) alarm_ = 0;  // chapter 8: 1 and 5 need a power cycle, 2 and 3 end with their cause
}

void SimulatedDrive::configuration_changed() {
  if (!behaviour_.configuration_makes_edges) terminals_.settle(motor_.shaft(), memory_);
  step(now_);
}

std::uint16_t SimulatedDrive::status() const {
  const unsigned bits = (in_position_ ? 1U : 0U) | (homed_ ? 2U : 0U) | (motor_.moving() ? 4U : 0U) |
                        (alarm_ != 0 ? 8U : 0U) | (enabled() ? 0U : 16U);  // bit 4: 1 is released
  return static_cast<std::uint16_t>(bits);
}

bool SimulatedDrive::output_active(int index) const {
  switch (memory_.get(static_cast<std::uint16_t>(reg::first_output_function + index))) {
    case 1:
      return alarm_ != 0;
    case 2:
      return enabled();  // what the brake does is not said: here active lets the motor turn
    case 3:
      return motor_.moving();
    case 4:
      return homed_;
    case 5:
      return in_position_;
    case 6:
      return activity_ == Activity::pt;
    default:
      return false;
  }
}

bool SimulatedDrive::output_level(int index) const {
  return ready() && output_active(index) != ((memory_.get(reg::output_levels) >> index & 1U) != 0);
}

std::uint16_t SimulatedDrive::peek(std::uint16_t address) const {
  const auto counter = static_cast<std::uint32_t>(motor_.counter());
  switch (address) {
    case reg::node:
      return node_;
    case reg::mode:
      return activity_ == Activity::homing ? 1
             : activity_ == Activity::pt   ? 2
             : activity_ == Activity::pv   ? 3
                                           : 0;
    case reg::moving:
      return motor_.moving() ? 1 : 0;
    case reg::direction:
      return motor_.direction() < 0 ? 1 : 0;
    case reg::alarm:
      return static_cast<std::uint16_t>(alarm_);
    case reg::status:
      return status();
    case reg::inputs:
      return terminals_.bits();
    case reg::outputs: {
      unsigned bits = 0;
      for (int i = 0; i < 4; ++i) bits |= output_active(i) ? 1U << i : 0U;
      return static_cast<std::uint16_t>(bits);
    }
    case reg::position_high:
      return static_cast<std::uint16_t>(counter >> 16U);
    case reg::position_low:
      return static_cast<std::uint16_t>(counter & 0xFFFFU);
    case reg::speed: {
      const auto rpm = std::lround(motor_.speed() * 60 / memory_.pulses_per_revolution());
      return static_cast<std::uint16_t>(behaviour_.unsigned_speed ? rpm : rpm * motor_.direction());
    }
    default:
      return address <= reg::last ? memory_.get(address) : 0;
  }
}

void SimulatedDrive::poke(std::uint16_t address, std::uint16_t value) {
  if (address > reg::last) return;
  memory_.poke(address, value);
  configuration_changed();
}

}  // namespace axisd::yako_rtu
