// Power, time and state of the simulated drive.
#include "devices/yako_rtu/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace axisd::yako_rtu {

namespace {

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
      shaft_(settings_.encoder, settings_.address),
      position_words_(behaviour_, shaft_),
      line_(model, behaviour_, settings_),
      motion_(shaft_.motor()),
      segments_(memory_, terminals_),
      homing_(model, behaviour_, memory_, terminals_, shaft_.motor(), position_words_) {
  if (!settings_.powered) return;
  power_up();
  supply_.skip_boot();
}

void SimulatedDrive::power_up() {
  supply_.boot(now_ + settings_.boot_time);
  memory_.power_up();
  position_words_.power_up();
  line_.power_up(memory_);
  control_mode_ = model_->pulse_input ? memory_.get(reg::control_mode) : std::uint16_t{0};
  open_loop_ = memory_.get(reg::loop_mode) == 1;
  enabled_ = behaviour_.enabled_at_power_up;
  in_position_ = behaviour_.in_position_at_power_up;
  alarm_.power_up();
  motion_.rest();
  later_.reset();
  segments_.stop();
  shaft_.forget_clearing();
  homing_.end_pause();
  homing_.forget();
  terminals_.settle(motor().shaft(), memory_);
}

void SimulatedDrive::set_power(bool on) {
  if (on == supply_.on()) return;
  if (on) {
    power_up();
    return;
  }
  cut();
  supply_.switch_off();
}

void SimulatedDrive::advance(TimePoint now) {
  now = std::max(now, now_);
  for (auto next = next_event(); next <= now; next = next_event()) step(std::max(next, now_));
  step(now);
}

TimePoint SimulatedDrive::next_event() const {
  if (!supply_.on()) return TimePoint::max();
  if (const auto end = supply_.boot_end()) return *end;
  auto next = std::min({motor().ends(), terminals_.next_event(), segments_.due(), shaft_.clear_due(),
                        homing_.due(), later_ ? later_->due : TimePoint::max()});
  if (motor().moving()) {
    const auto change = terminals_.next_switch(motor().shaft(), motor().direction());
    if (change) next = std::min(next, motor().reaches(*change));
    if (in_control()) next = std::min(next, motor().lags(deviation_limit()));
  }
  return next;
}

void SimulatedDrive::step(TimePoint now) {
  now_ = now;
  const bool ended = motor().advance(now, in_control());
  follow(now);
  if (supply_.booted(now)) terminals_.settle(motor().shaft(), memory_);
  if (!ready()) return;
  for (const auto& edge : terminals_.sample(now, motor().shaft(), memory_)) on_edge(edge);
  if (motor().moving() && !enabled()) cut();
  if (in_control() && std::llabs(motor().lag()) >= deviation_limit()) show_alarm(5);
  enforce_limits();
  if (ended && !motor().moving()) on_stopped();
  do_what_is_due(now);
  update_multi_speed();
}

void SimulatedDrive::do_what_is_due(TimePoint now) {
  if (homing_.due() <= now && homing_.on_stopped(now)) finish();
  if (segments_.due() <= now) begin(segments_.begin_selected(motor()));
  if (later_ && later_->due <= now) start_now();
  if (shaft_.clear_due() <= now) {
    shaft_.forget_clearing();
    position_words_.clear();
  }
}

simulation::Hold SimulatedDrive::hold() const {
  return {.in_control = in_control(),
          .energised = ready() && enabled(),
          .seen = ready() && closed_loop() && !behaviour_.released_position_frozen};
}

/// What the load and the encoder do meanwhile.
void SimulatedDrive::follow(TimePoint now) {
  shaft_.encoder().set_resolution(pulses_of_counts(1));
  shaft_.follow(now, hold(), closed_loop() ? shaft_.encoder().settings().following : Duration{});
}

void SimulatedDrive::set_input(std::string_view terminal, std::optional<bool> active) {
  terminals_.drive(terminal, active);
  step(now_);
}

bool SimulatedDrive::has_input(std::string_view terminal) const {
  return std::ranges::find(model_->inputs, terminal, &TerminalSpec::name) != model_->inputs.end();
}

void SimulatedDrive::raise_alarm(int code) {
  alarm_.set_cause(code);
  if (code == 0) {
    if (alarm_.of_voltage()) alarm_.clear();  // chapter 8: these reset automatically
    return;
  }
  if (supply_.on()) show_alarm(code);
}

void SimulatedDrive::show_alarm(int code) {
  if (!alarm_.show(code)) return;
  cut();
  if (behaviour_.alarm_releases) enabled_ = false;
}

void SimulatedDrive::block_shaft(bool blocked) {
  motor().block(blocked);
  step(now_);
}

bool SimulatedDrive::run_at(double factor) {
  motor().run_at(factor);
  return true;
}

bool SimulatedDrive::lean_on_shaft(int counts) { return shaft_.lean(counts, hold()); }

bool SimulatedDrive::push_shaft(std::int64_t pulses) {
  if (!shaft_.push(pulses, hold())) return false;
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
  return shows_encoder() ? shaft_.measured(now_) : motor().counter();
}

/// 0x011F gives no unit: taken as counts of the encoder, as 0x0116.
bool SimulatedDrive::in_position() const {
  if (!in_position_ || !closed_loop()) return in_position_;
  const auto window =
      static_cast<std::int64_t>(std::ceil(pulses_of_counts(memory_.get(reg::positioning_accuracy))));
  return shaft_.within(window, now_);
}

void SimulatedDrive::clear_alarm() {
  if (alarm_.can_be_cleared()) alarm_.clear();
}

void SimulatedDrive::configuration_changed() {
  if (!behaviour_.configuration_makes_edges) terminals_.settle(motor().shaft(), memory_);
  step(now_);
}

std::uint16_t SimulatedDrive::mode() const {
  switch (behaviour_.mode_stays && motion_.is(Activity::none) ? motion_.last_activity()
                                                              : motion_.activity()) {
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
  const unsigned bits = (in_position() ? 1U : 0U) | (homing_.homed() ? 2U : 0U) |
                        (motor().moving() ? 4U : 0U) | (alarm_.on() ? 8U : 0U) |
                        (enabled() ? 0U : 16U);  // bit 4: 1 is released
  return static_cast<std::uint16_t>(bits);
}

bool SimulatedDrive::output_active(int index) const {
  const auto code = memory_.get(static_cast<std::uint16_t>(reg::first_output_function + index));
  // The range of the registers goes on beyond the functions that the table lists.
  switch (code < model_->output_functions.size() ? model_->output_functions[code] : Output::none) {
    case Output::alarm:
      return alarm_.on();
    case Output::brake:
      return enabled();  // what the brake does is not said: here active lets the motor turn
    case Output::moving:
      return motor().moving();
    case Output::homed:
      return homing_.homed();
    case Output::in_position:
      return in_position();
    case Output::pt_mode:
      return motion_.is(Activity::pt);
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
      return line_.address();
    case reg::mode:
      return mode();
    case reg::moving:
      return motor().moving() ? 1 : 0;
    case reg::direction:
      return motor().direction() < 0 ? 1 : 0;
    case reg::alarm:
      return static_cast<std::uint16_t>(alarm_.shown());
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
      const auto rpm = std::lround(motor().speed() * 60 / memory_.pulses_per_revolution());
      return static_cast<std::uint16_t>(behaviour_.unsigned_speed ? rpm : rpm * motor().direction());
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
