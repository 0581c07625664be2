// Power, time and state of the simulated drive.
#include "devices/yako_rtu/simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace axisd::yako_rtu {

namespace {

using simulation::Serial;

/// Its 4.4: the switches hold the address, or are all off, and 0x0013 counts.
std::uint8_t dip_address(const SimulatedModel& model, const simulation::SimulatedNodeSettings& settings) {
  return settings.dip_address.value_or(settings.address <= model.maximum_dip_address ? settings.address : 0);
}

simulation::SimulatedNodeSettings with_defaults(const SimulatedModel& model,
                                                simulation::SimulatedNodeSettings settings,
                                                const Behaviour& behaviour) {
  if (behaviour.other_model_code) settings.eeprom.try_emplace(reg::model, model.other_model_code);
  settings.dip_address = dip_address(model, settings);
  if (settings.dip_address == 0) settings.eeprom.try_emplace(reg::custom_node, settings.address);
  return settings;
}

// Codes of 0x0015 (6.1).
constexpr std::array<modbus_rtu::Format, 4> formats{{{.parity = modbus_rtu::Parity::none, .stop_bits = 1},
                                                     {.parity = modbus_rtu::Parity::none, .stop_bits = 2},
                                                     {.parity = modbus_rtu::Parity::even, .stop_bits = 1},
                                                     {.parity = modbus_rtu::Parity::odd, .stop_bits = 1}}};

}  // namespace

std::unique_ptr<simulation::SimulatedRtuNode> make_simulated_drive(
    const SimulatedModel& model, simulation::SimulatedNodeSettings settings) {
  return std::make_unique<SimulatedDrive>(model, std::move(settings));
}

SimulatedDrive::SimulatedDrive(const SimulatedModel& model, simulation::SimulatedNodeSettings settings)
    : model_(&model),
      behaviour_(behaviour_from(model, settings.switches)),
      settings_(with_defaults(model, std::move(settings), behaviour_)),
      memory_(model, behaviour_, settings_.eeprom),
      terminals_(model, behaviour_, settings_),
      encoder_(settings_.encoder, settings_.address),
      node_(settings_.address),
      dip_baud_(settings_.dip_baud) {
  if (!settings_.powered) return;
  power_up();
  boot_end_.reset();
}

void SimulatedDrive::power_up() {
  powered_ = true;
  boot_end_ = now_ + settings_.boot_time;
  memory_.power_up();
  motor_.power_up();
  position_high_read_.reset();
  const auto custom = memory_.get(reg::custom_node);
  const bool defined = custom >= model_->first_custom_address && custom <= model_->last_custom_address;
  const std::uint8_t fallback =
      behaviour_.undefined_address_is_1 ? std::uint8_t{1} : model_->undefined_custom_address;
  node_ = *settings_.dip_address != 0 ? *settings_.dip_address
          : defined                   ? static_cast<std::uint8_t>(custom)
                                      : fallback;
  set_serial();
  control_mode_ = model_->pulse_input ? memory_.get(reg::control_mode) : std::uint16_t{0};
  open_loop_ = memory_.get(reg::loop_mode) == 1;
  enabled_ = behaviour_.enabled_at_power_up;
  in_position_ = behaviour_.in_position_at_power_up;
  homed_ = false;
  alarm_ = cause_;
  activity_ = last_activity_ = Activity::none;
  multi_speed_.on = stopping_ = false;
  segment_due_ = clear_due_ = homing_due_ = TimePoint::max();
  later_.reset();
  terminals_.settle(motor_.shaft(), memory_);
}

/// 6.1: 0x0014 and 0x0015 count from the next power-up; 4.4: the switches before 0x0014.
void SimulatedDrive::set_serial() {
  if (!dip_baud_) return;
  const auto custom = model_->custom_bauds.at(memory_.get(reg::custom_baud) & 3U);
  serial_ = Serial{.baud = *dip_baud_ != 0 ? *dip_baud_ : custom,
                   .format = formats.at(memory_.get(reg::serial_format) & 3U)};
}

void SimulatedDrive::join(const Serial& line) {
  if (settings_.dip_baud) return;
  dip_baud_ = std::ranges::find(model_->dip_bauds, line.baud) != model_->dip_bauds.end() ? line.baud : 0;
  const auto preset = [&](std::uint16_t address, auto index) {
    if (index < 4 && !settings_.eeprom.contains(address))
      memory_.preset(address, static_cast<std::uint16_t>(index));
  };
  if (*dip_baud_ == 0)
    preset(reg::custom_baud,
           std::ranges::find(model_->custom_bauds, line.baud) - model_->custom_bauds.begin());
  preset(reg::serial_format, std::ranges::find_if(formats, [&](const modbus_rtu::Format& one) {
                               return one.parity == line.format.parity &&
                                      one.stop_bits == line.format.stop_bits;
                             }) - formats.begin());
  set_serial();
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
  auto next = std::min({motor_.ends(), terminals_.next_event(), segment_due_, clear_due_, homing_due_,
                        later_ ? later_->due : TimePoint::max()});
  if (motor_.moving()) {
    const auto change = terminals_.next_switch(motor_.shaft(), motor_.direction());
    if (change) next = std::min(next, motor_.reaches(*change));
    if (in_control()) next = std::min(next, motor_.lags(deviation_limit()));
  }
  return next;
}

void SimulatedDrive::step(TimePoint now) {
  now_ = now;
  const bool ended = motor_.advance(now, in_control());
  follow(now);
  if (boot_end_ && now >= *boot_end_) {
    boot_end_.reset();
    terminals_.settle(motor_.shaft(), memory_);
  }
  if (!ready()) return;
  for (const auto& edge : terminals_.sample(now, motor_.shaft(), memory_)) on_edge(edge);
  if (motor_.moving() && !enabled()) cut();
  if (in_control() && std::llabs(motor_.lag()) >= deviation_limit()) show_alarm(5);
  enforce_limits();
  if (ended && !motor_.moving()) on_stopped();
  if (homing_due_ <= now) homing_stopped();
  if (segment_due_ <= now) start_segment();
  if (later_ && later_->due <= now) start_now();
  if (clear_due_ <= now) {
    clear_due_ = TimePoint::max();
    clear_counter();
  }
  update_multi_speed();
}

void SimulatedDrive::clear_counter() {
  motor_.clear_counter();
  position_high_read_.reset();  // no carry
}

/// What the load and the encoder do meanwhile.
void SimulatedDrive::follow(TimePoint now) {
  encoder_.set_resolution(pulses_of_counts(1));
  motor_.follow_within(closed_loop() ? encoder_.settings().following : Duration{});
  if (!in_control()) encoder_.relax();
  const bool held = motor_.blocked() || motor_.moving() || (ready() && enabled());
  if (const auto pulses = encoder_.slipped(now, !held); pulses != 0)
    motor_.push(pulses, ready() && closed_loop() && !behaviour_.released_position_frozen);
}

void SimulatedDrive::set_input(std::string_view terminal, std::optional<bool> active) {
  terminals_.drive(terminal, active);
  step(now_);
}

bool SimulatedDrive::has_input(std::string_view terminal) const {
  return std::ranges::find(model_->inputs, terminal, &TerminalSpec::name) != model_->inputs.end();
}

void SimulatedDrive::raise_alarm(int code) {
  if (code == 0) {
    cause_ = 0;
    if (alarm_ == 2 || alarm_ == 3) alarm_ = 0;  // chapter 8: these reset automatically
    return;
  }
  cause_ = code == 2 || code == 3 ? code : 0;
  if (powered_) show_alarm(code);
}

void SimulatedDrive::show_alarm(int code) {
  if (alarm_ == 1 || alarm_ == 5) return;  // chapter 8: stays until the next power-up
  alarm_ = code;
  cut();
  if (behaviour_.alarm_releases) enabled_ = false;
}

void SimulatedDrive::block_shaft(bool blocked) {
  motor_.block(blocked);
  step(now_);
}

bool SimulatedDrive::run_at(double factor) {
  motor_.run_at(factor);
  return true;
}

bool SimulatedDrive::lean_on_shaft(int counts) { return in_control() && encoder_.lean(counts); }

bool SimulatedDrive::push_shaft(std::int64_t pulses) {
  if (motor_.blocked() || (ready() && enabled())) return false;
  motor_.push(pulses, ready() && closed_loop() && !behaviour_.released_position_frozen);
  step(now_);
  return true;
}

double SimulatedDrive::pulses_of_counts(double counts) const {
  return counts * memory_.pulses_per_revolution() /
         (memory_.get(reg::encoder_resolution) == 1 ? 10000 : 4000);
}

/// In pulses. 0x0116 gives no unit: taken as counts of the encoder, so that its default is one revolution.
std::int64_t SimulatedDrive::deviation_limit() const {
  return static_cast<std::int64_t>(pulses_of_counts(memory_.get(reg::deviation_threshold))) + 1;
}

std::int32_t SimulatedDrive::position() const {
  return shows_encoder() ? encoder_.position(motor_, now_) : motor_.counter();
}

/// 0x011F gives no unit: taken as counts of the encoder, as 0x0116.
bool SimulatedDrive::in_position() const {
  if (!in_position_ || !closed_loop()) return in_position_;
  const auto window =
      static_cast<std::int64_t>(std::ceil(pulses_of_counts(memory_.get(reg::positioning_accuracy))));
  return std::llabs(encoder_.deviation(motor_, now_)) <= window;
}

void SimulatedDrive::clear_alarm() {
  if (alarm_ == 4) alarm_ = 0;  // chapter 8: 1 and 5 need a power cycle, 2 and 3 end with their cause
}

void SimulatedDrive::configuration_changed() {
  if (!behaviour_.configuration_makes_edges) terminals_.settle(motor_.shaft(), memory_);
  step(now_);
}

std::uint16_t SimulatedDrive::mode() const {
  switch (behaviour_.mode_stays && activity_ == Activity::none ? last_activity_ : activity_) {
    case Activity::homing:
      return 1;
    case Activity::pt:
      return 2;
    case Activity::pv:
      return 3;
    default:
      return 0;
  }
}

std::uint16_t SimulatedDrive::status() const {
  const unsigned bits = (in_position() ? 1U : 0U) | (homed_ ? 2U : 0U) | (motor_.moving() ? 4U : 0U) |
                        (alarm_ != 0 ? 8U : 0U) | (enabled() ? 0U : 16U);  // bit 4: 1 is released
  return static_cast<std::uint16_t>(bits);
}

bool SimulatedDrive::output_active(int index) const {
  const auto code = memory_.get(static_cast<std::uint16_t>(reg::first_output_function + index));
  // The range of the registers goes on beyond the functions that the table lists.
  switch (code < model_->output_functions.size() ? model_->output_functions[code] : Output::none) {
    case Output::alarm:
      return alarm_ != 0;
    case Output::brake:
      return enabled();  // what the brake does is not said: here active lets the motor turn
    case Output::moving:
      return motor_.moving();
    case Output::homed:
      return homed_;
    case Output::in_position:
      return in_position();
    case Output::pt_mode:
      return activity_ == Activity::pt;
    case Output::none:
      break;
  }
  return false;
}

bool SimulatedDrive::output_level(int index) const {
  return ready() && output_active(index) != ((memory_.get(reg::output_levels) >> index & 1U) != 0);
}

std::uint32_t SimulatedDrive::peek(std::uint32_t wide) const {
  const auto address = static_cast<std::uint16_t>(wide);
  const auto counter = static_cast<std::uint32_t>(position());
  switch (address) {
    case reg::node:
      return node_;
    case reg::mode:
      return mode();
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
      for (int i = 0; i < model_->outputs; ++i) bits |= output_active(i) ? 1U << i : 0U;
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
      return address <= model_->last ? memory_.get(address) : 0;
  }
}

void SimulatedDrive::poke(std::uint32_t wide, std::uint32_t value) {
  const auto address = static_cast<std::uint16_t>(wide);
  if (address > model_->last) return;
  memory_.poke(address, static_cast<std::uint16_t>(value));
  if (address == reg::loop_mode && !behaviour_.loop_mode_from_power_up) open_loop_ = value == 1;
  configuration_changed();
}

}  // namespace axisd::yako_rtu
