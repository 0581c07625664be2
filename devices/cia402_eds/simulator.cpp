// Power, time and inputs of the simulated standard drive.
#include "devices/cia402_eds/simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "devices/cia402_eds/simulator_dictionary.hpp"

namespace axisd::cia402_eds {

namespace {

using simulation::SimulatedNodeSettings;

constexpr TerminalSpec inputs[] = {{"NEG"}, {"POS"}, {"HOME"}};
/// Error codes of CiA 402-2 that it can report.
constexpr int codes[] = {0x1000, 0x2110, 0x2120, 0x2220, 0x2230, 0x2310, 0x2320, 0x2330, 0x2340,
                         0x2350, 0x3110, 0x3120, 0x3130, 0x3210, 0x3220, 0x4110, 0x4210, 0x4310,
                         0x5113, 0x5441, 0x5530, 0x6100, 0x6320, 0x7110, 0x7121, 0x7300, 0x7305,
                         0x7310, 0x7500, 0x8130, 0x8400, 0x8500, 0x8611, 0x8612};
constexpr Duration communication_reset_time = std::chrono::milliseconds(10);

std::unique_ptr<simulation::SimulatedCanNode> make(SimulatedNodeSettings settings) {
  return std::make_unique<StandardDrive>(std::move(settings));
}

}  // namespace

std::span<const simulation::Simulator> simulators() {
  static const std::array<simulation::Simulator, 1> all{{{.model = "cia402",
                                                          .make_can = &make,
                                                          .switches = switch_specs(),
                                                          .inputs = inputs,
                                                          .last_register = 0x6502FF,
                                                          .maximum_dip_address = 127,
                                                          .takes_sheet = true}}};
  return all;
}

StandardDrive::StandardDrive(SimulatedNodeSettings settings)
    : behaviour_(behaviour_from(settings.switches)),
      settings_(std::move(settings)),
      server_({.pdos = settings_.sheet ? pdo_settings_of(*settings_.sheet) : pdo_settings,
               .sdo = {.segmented_uploads = behaviour_.segmented_uploads},
               .error_count_grows = settings_.sheet != nullptr},
              dictionary_, hooks(), [this](bool communication_only) { nmt_reset(communication_only); }),
      inputs_(cia402_eds::inputs, {home_switch, positive_limit, negative_limit}, settings_),
      shaft_(settings_.encoder, settings_.address),
      tachometer_({.noise = 1}, settings_.address),
      objects_(dictionary_),
      motion_(shaft_.motor()),
      arrival_(objects_, shaft_),
      homing_(behaviour_, objects_, inputs_, shaft_.motor()) {
  if (settings_.sheet)
    add_rows_of_sheet(dictionary_, settings_);
  else
    add_rows(dictionary_);
  for (const auto& [key, value] : settings_.eeprom) dictionary_.preset(key, value);
  objects_.set_units(units_of(dictionary_, settings_.units));
  if (!settings_.powered) return;
  restart(true);
  supply_.skip_boot();
  server_.boot_quietly(settings_.address, now_);
}

/// Everything as after a power-up: nothing runs and nothing waits.
void StandardDrive::restart(bool counter_lost) {
  cut();
  supply_.boot(now_ + settings_.boot_time);
  if (std::exchange(load_defaults_, false)) dictionary_.restore_factory();
  dictionary_.power_up();
  for (const auto index : volatile_objects())
    if (const auto* row = dictionary_.find(index, 0); row != nullptr)
      dictionary_.set(index, 0, row->default_value);
  objects_.set_units(units_of(dictionary_, settings_.units));
  if (counter_lost) motor().power_up();
  const auto mode = dictionary_.get(0x6060);
  control_.reset(PowerState::disabled, supports(mode) ? static_cast<int>(mode) : 0);
  mode_changed_ = false;
  fault_.reset(false);
  motion_.rest();
  set_points_.drop_all();
  set_points_.end_acknowledgement();
  velocity_.release();
  arrival_.forget();
  homing_.forget();
  inputs_.settle(motor().shaft(), {.functions = {negative_limit, positive_limit, home_switch}});
  server_.boot(settings_.address, *supply_.boot_end());
}

void StandardDrive::nmt_reset(bool communication_only) {
  if (!communication_only) {
    restart(true);
    return;
  }
  dictionary_.power_up(0x1000, 0x1FFF);
  server_.boot(server_.node(), now_ + communication_reset_time);
}

void StandardDrive::set_power(bool on) {
  if (on == supply_.on()) return;
  if (on) {
    restart(true);
    return;
  }
  cut();
  control_.enter(PowerState::disabled);
  supply_.switch_off();
  server_.switch_off();
}

void StandardDrive::advance(TimePoint now) {
  now = std::max(now, now_);
  for (auto next = next_event(); next <= now; next = next_event()) step(std::max(next, now_));
  step(now);
}

TimePoint StandardDrive::next_event() const {
  if (!supply_.on()) return TimePoint::max();
  return std::min({motion_event(), late_bits_event(), server_.next_event()});
}

TimePoint StandardDrive::motion_event() const {
  if (const auto end = supply_.boot_end()) return *end;
  if (!motor().moving()) return std::min(homing_.due(), arrival_.next_event(now_));
  auto next = motor().ends();
  if (const auto most = objects_.window(0x6065)) next = std::min(next, motor().lags(*most + 1));
  const auto change = inputs_.next_switch(motor().shaft(), motor().direction());
  return change ? std::min(next, motor().reaches(*change)) : next;
}

void StandardDrive::step(TimePoint now) {
  constexpr int following_error = 0x8611;
  now_ = now;
  const bool ended = motor().advance(now, energised());
  follow(now);
  supply_.booted(now);
  if (alive()) {
    for (const auto& edge :
         inputs_.sample(now, motor().shaft(), {.functions = {negative_limit, positive_limit, home_switch}}))
      if (motion_.is(Activity::homing)) act_on(homing_.on_edge(edge));
    if (const auto most = objects_.window(0x6065); most && energised() && std::llabs(motor().lag()) > *most)
      fail_with(following_error);
    enforce_limits();
    if (ended && !motor().moving()) on_stopped();
    if (homing_.due() <= now) act_on(homing_.next_phase());
    follow_velocity();
    // Event PDOs look when something changed; what changes with time alone they look at by themselves.
    if (const auto present = appearance(); std::exchange(appearance_, present) != present) server_.touch(now);
  }
  server_.advance(now);
}

TimePoint StandardDrive::late_bits_event() const {
  auto next = TimePoint::max();
  for (const auto due : {set_points_.shown_from(), homing_.told_from()})
    if (due > now_) next = std::min(next, due);
  return next;
}

simulation::Hold StandardDrive::hold() const {
  return {.in_control = energised(), .energised = energised(), .seen = supply_.on()};
}

/// What the load and the encoder do meanwhile.
void StandardDrive::follow(TimePoint now) {
  constexpr double settling = 30, longest = 0.025;  // counts, seconds
  auto following = shaft_.encoder().settings().following;
  if (behaviour_.settles_over_30_counts)  // at the end of a ramp it is behind by ramp x time^2
    following = std::max(following, std::chrono::round<Duration>(std::chrono::duration<double>(
                                        std::min(std::sqrt(settling / objects_.ramp(0x6084)), longest))));
  shaft_.follow(now, hold(), following);
  arrival_.watch_window(now);
}

/// All that can change by itself and shows in mappable objects, but the position.
std::uint64_t StandardDrive::appearance() const {
  return std::uint64_t{status()} | std::uint64_t{inputs_.bits()} << 16U |
         (motor().moving() ? std::uint64_t{1} << 32U : 0U) |
         static_cast<std::uint64_t>(motion_.starts()) << 33U;
}

void StandardDrive::on_frame(const can::Frame& frame) {
  if (!supply_.on()) return;
  server_.on_frame(frame, now_);
  step(now_);
}

void StandardDrive::set_input(std::string_view terminal, std::optional<bool> active) {
  inputs_.drive(terminal, active);
  step(now_);
}

std::span<const int> StandardDrive::alarms() const { return codes; }

void StandardDrive::raise_alarm(int code) {
  if (code != 0 && alive()) fail_with(code);
  step(now_);
}

void StandardDrive::block_shaft(bool blocked) {
  motor().block(blocked);
  step(now_);
}

bool StandardDrive::run_at(double factor) {
  motor().run_at(factor);
  return true;
}

bool StandardDrive::push_shaft(std::int64_t pulses) {
  if (!shaft_.push(pulses, hold())) return false;
  server_.touch(now_);
  step(now_);
  return true;
}

bool StandardDrive::lean_on_shaft(int counts) {
  if (!shaft_.lean(counts, hold())) return false;
  server_.touch(now_);
  step(now_);
  return true;
}

std::uint32_t StandardDrive::peek(std::uint32_t address) const {
  const auto* row =
      dictionary_.find(static_cast<std::uint16_t>(address >> 8U), static_cast<std::uint8_t>(address));
  return row == nullptr ? 0 : static_cast<std::uint32_t>(server_.objects().value(*row));
}

void StandardDrive::poke(std::uint32_t address, std::uint32_t value) {
  dictionary_.set(static_cast<std::uint16_t>(address >> 8U), static_cast<std::uint8_t>(address), value);
  server_.touch(now_);
  step(now_);
}

}  // namespace axisd::cia402_eds
