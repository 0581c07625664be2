#include "tests/foreign_modbus/simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "devices/simulation/crc.hpp"
#include "devices/simulation/mechanics.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/foreign_modbus/registers.hpp"

namespace axisd::acme_s1 {

std::span<const simulation::Simulator> simulators();

namespace {

constexpr TerminalSpec terminals[] = {{"I1"}, {"I2"}};
constexpr std::uint16_t serial_number = 4711, version = 207;

std::uint16_t word(std::span<const std::uint8_t> frame, std::size_t at) {
  return static_cast<std::uint16_t>(frame[at] << 8 | frame[at + 1]);
}

void append_word(std::vector<std::uint8_t>& frame, std::uint16_t value) {
  frame.push_back(static_cast<std::uint8_t>(value >> 8U));
  frame.push_back(static_cast<std::uint8_t>(value & 0xFFU));
}

std::unique_ptr<simulation::SimulatedRtuNode> make(simulation::SimulatedNodeSettings settings) {
  return std::make_unique<SimulatedServo>(std::move(settings));
}

}  // namespace

SimulatedServo::SimulatedServo(simulation::SimulatedNodeSettings settings)
    : settings_(std::move(settings)),
      encoder_(settings_.encoder, settings_.address),
      saved_{{reg::counts, counts_per_revolution},
             {reg::first_input, function::none},
             {reg::second_input, function::none}} {
  if (!settings_.powered) return;
  power_up();
  boot_end_.reset();
}

void SimulatedServo::power_up() {
  powered_ = true;
  boot_end_ = now_ + settings_.boot_time;
  // Nothing of this is like what a YAKO drive powers up with.
  memory_ = {{reg::target_low, 0},      {reg::target_high, 0}, {reg::profile_velocity, 77},
             {reg::rise_time, 500},     {reg::fall_time, 500}, {reg::homing_method, method::to_positive},
             {reg::homing_velocity, 0}, {reg::tag, 0},         {reg::tag + 1, 0}};
  motor_.power_up();
  energised_ = at_target_ = referenced_ = false;
  mode_ = mode::idle;
  fault_ = cause_;
}

void SimulatedServo::cut() {
  motor_.stop(false);
  mode_ = mode::idle;
}

void SimulatedServo::set_power(bool on) {
  if (on == powered_) return;
  if (on) {
    power_up();
    return;
  }
  cut();
  powered_ = energised_ = false;
  boot_end_.reset();
}

/// Where the shaft gets on the home switch in the direction of its search.
std::optional<std::int64_t> SimulatedServo::home_edge() const {
  return memory_.at(reg::homing_method) == method::to_positive ? settings_.mechanics.home_switch_from
                                                               : settings_.mechanics.home_switch_to;
}

void SimulatedServo::advance(TimePoint now) {
  if (const auto edge = home_edge(); mode_ == mode::homing && edge && motor_.moving())
    if (const auto there = motor_.reaches(*edge); there <= now) {
      pass(there);
      cut();
      motor_.clear_counter();
      referenced_ = at_target_ = true;
    }
  pass(now);
}

void SimulatedServo::pass(TimePoint now) {
  now_ = now;
  if (motor_.advance(now, energised_)) {
    at_target_ = mode_ == mode::moving && !motor_.braking();
    mode_ = mode::idle;
  }
  if (boot_end_ && now >= *boot_end_) boot_end_.reset();
}

void SimulatedServo::set_input(std::string_view terminal, std::optional<bool> active) {
  if (!has_input(terminal)) return;
  if (active)
    driven_.insert_or_assign(std::string(terminal), *active);
  else
    driven_.erase(std::string(terminal));
}

bool SimulatedServo::has_input(std::string_view terminal) const {
  return std::ranges::find(terminals, terminal, &TerminalSpec::name) != std::end(terminals);
}

bool SimulatedServo::input(std::size_t index) const {
  const auto held = driven_.find(terminals[index].name);
  const auto setting = saved_.at(static_cast<std::uint16_t>(reg::first_input + index));
  const bool low_level_counts = (setting & function::active_low) != 0;
  if (held != driven_.end()) return held->second != low_level_counts;
  return (setting & 0xFFU) == function::home &&
         switch_active(settings_.mechanics, simulation::SwitchKind::home, motor_.shaft());
}

std::uint16_t SimulatedServo::inputs() const {
  return static_cast<std::uint16_t>((input(0) ? 1U : 0U) | (input(1) ? 2U : 0U));
}

void SimulatedServo::raise_alarm(int code) {
  cause_ = static_cast<std::uint16_t>(code);
  if (code == 0) return;
  fault_ = cause_;
  cut();
  energised_ = false;
}

std::uint16_t SimulatedServo::status() const {
  std::uint16_t bits = 0;
  if (motor_.moving()) bits |= status::running;
  if (at_target_) bits |= status::at_target;
  if (referenced_) bits |= status::referenced;
  if (energised_) bits |= status::powered;
  if (fault_ != 0) bits |= status::faulty;
  return bits;
}

std::optional<std::uint16_t> SimulatedServo::get(std::uint16_t address) const {
  const auto position = static_cast<std::uint32_t>(encoder_.position(motor_, now_));
  const auto rpm = motor_.shaft_speed() * 60 / counts_per_revolution;
  const std::map<std::uint16_t, std::uint16_t> shown = {
      {reg::identity, serial_number},
      {reg::identity + 1, model_code},
      {reg::identity + 2, version},
      {reg::state, status()},
      {reg::fault, fault_},
      {reg::position_low, static_cast<std::uint16_t>(position)},
      {reg::position_high, static_cast<std::uint16_t>(position >> 16U)},
      {reg::velocity, static_cast<std::uint16_t>(std::lround(rpm * counts_per_rpm))},
      {reg::mode, mode_},
      {reg::inputs, inputs()}};
  for (const auto* words : {&shown, &saved_, &memory_})
    if (const auto found = words->find(address); found != words->end()) return found->second;
  return std::nullopt;
}

std::uint32_t SimulatedServo::peek(std::uint32_t address) const {
  return get(static_cast<std::uint16_t>(address)).value_or(0);
}

void SimulatedServo::poke(std::uint32_t address, std::uint32_t value) {
  const auto at = static_cast<std::uint16_t>(address);
  auto& words = saved_.contains(at) ? saved_ : memory_;
  words[at] = static_cast<std::uint16_t>(value);
}

std::uint8_t SimulatedServo::start(std::uint16_t command) {
  if (!energised_ || fault_ != 0 || motor_.moving()) return exception::state;
  const auto at = [&](std::uint16_t address) { return memory_.at(address); };
  const bool homes = command == command::home;
  const auto velocity = static_cast<std::int16_t>(at(homes ? reg::homing_velocity : reg::profile_velocity)) /
                        static_cast<double>(counts_per_rpm);
  const auto rates = simulation::rates_from(0, std::abs(velocity), at(reg::rise_time), at(reg::fall_time),
                                            counts_per_revolution);
  ++starts_;
  at_target_ = false;
  if (command == command::move) {
    const auto target =
        static_cast<std::int32_t>(std::uint32_t{at(reg::target_high)} << 16U | at(reg::target_low));
    const auto distance = std::int64_t{target} - motor_.counter();
    mode_ = mode::moving;
    at_target_ = distance == 0;
    if (distance != 0) motor_.move(distance, rates);
    return 0;
  }
  mode_ = homes ? mode::homing : mode::turning;
  if (homes) referenced_ = false;
  const bool positive = homes ? at(reg::homing_method) == method::to_positive : velocity > 0;
  motor_.run(positive ? 1 : -1, rates);
  return 0;
}

std::uint8_t SimulatedServo::set(std::uint16_t address, std::uint16_t value) {
  if (address == reg::command) {
    const bool known = value == command::move || value == command::turn || value == command::home;
    return known ? start(value) : exception::value;
  }
  if (address == reg::stop) {
    if (value != stop::ramp && value != stop::quick) return exception::value;
    if (value == stop::quick)
      cut();
    else if (motor_.moving())
      motor_.brake();
    return 0;
  }
  if (address == reg::power) {
    if (value != power::on && value != power::off) return exception::value;
    energised_ = value == power::on && fault_ == 0;
    if (!energised_) cut();
    return 0;
  }
  if (address == reg::fault_reset) {
    fault_ = cause_;
    return 0;
  }
  if (address == reg::declare_zero) {
    if (motor_.moving()) return exception::state;
    motor_.clear_counter();
    return 0;
  }
  if (saved_.contains(address)) {
    if (address == reg::counts && value != counts_per_revolution) return exception::value;
    saved_[address] = value;
    ++eeprom_writes_;
    return 0;
  }
  if (!memory_.contains(address)) return exception::no_register;
  memory_[address] = value;
  return 0;
}

std::optional<std::vector<std::uint8_t>> SimulatedServo::on_frame(std::span<const std::uint8_t> frame) {
  if (!powered_ || boot_end_ || frame.size() < 4 || frame[0] != settings_.address) return std::nullopt;
  std::vector<std::uint8_t> reply{frame[0], frame[1]};
  std::uint8_t refusal = 0;
  const bool reads = frame[1] == 0x03, writes_one = frame[1] == 0x06, writes_many = frame[1] == 0x10;
  if (!simulation::frame_is_sound(frame)) {
    refusal = exception::damaged_frame;
  } else if (frame.size() < 8 || (!reads && !writes_one && !writes_many)) {
    refusal = exception::no_function;
  } else if (reads) {
    reply.push_back(static_cast<std::uint8_t>(2 * word(frame, 4)));
    for (std::uint16_t i = 0; i < word(frame, 4); ++i) {
      const auto value = get(static_cast<std::uint16_t>(word(frame, 2) + i));
      if (!value) refusal = exception::no_register;
      append_word(reply, value.value_or(0));
    }
  } else {
    const std::uint16_t count = writes_one ? 1 : word(frame, 4);
    for (std::uint16_t i = 0; i < count && refusal == 0; ++i)
      refusal = set(static_cast<std::uint16_t>(word(frame, 2) + i), word(frame, writes_one ? 4 : 7 + 2 * i));
    append_word(reply, word(frame, 2));
    append_word(reply, word(frame, 4));
  }
  if (refusal != 0) reply = {frame[0], static_cast<std::uint8_t>(frame[1] | 0x80U), refusal};
  simulation::append_frame_crc(reply);
  return reply;
}

std::span<const simulation::Simulator> simulators() {
  static const simulation::Simulator all[] = {{.model = "acme-s1",
                                               .make = &make,
                                               .inputs = terminals,
                                               .last_register = reg::declare_zero,
                                               .maximum_node = 247,
                                               .maximum_dip_address = 247}};
  return all;
}

}  // namespace axisd::acme_s1
