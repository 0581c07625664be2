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
      encoder_(settings_.encoder, settings_.address),
      tachometer_({.noise = 1}, settings_.address) {
  if (settings_.sheet)
    add_rows_of_sheet(dictionary_, settings_);
  else
    add_rows(dictionary_);
  for (const auto& [key, value] : settings_.eeprom) dictionary_.preset(key, value);
  units_ = units_of(dictionary_, settings_.units);
  if (!settings_.powered) return;
  powered_ = true;
  restart(true);
  boot_end_.reset();
  server_.boot_quietly(settings_.address, now_);
}

/// Everything as after a power-up: nothing runs and nothing waits.
void StandardDrive::restart(bool counter_lost) {
  cut();
  boot_end_ = now_ + settings_.boot_time;
  if (std::exchange(load_defaults_, false)) dictionary_.restore_factory();
  dictionary_.power_up();
  for (const auto index : volatile_objects())
    if (const auto* row = dictionary_.find(index, 0); row != nullptr)
      dictionary_.set(index, 0, row->default_value);
  units_ = units_of(dictionary_, settings_.units);
  if (counter_lost) motor_.power_up();
  state_ = State::disabled;
  control_ = 0;
  mode_ = supports(dictionary_.get(0x6060)) ? static_cast<int>(dictionary_.get(0x6060)) : 0;
  fault_ = last_fault_ = 0;
  reached_ = acknowledged_ = limited_ = attained_ = homing_error_ = homing_interrupted_ = false;
  mode_changed_ = false;
  activity_ = Activity::none;
  stopping_ = velocity_held_ = false;
  inputs_.settle(motor_.shaft(), {.functions = {negative_limit, positive_limit, home_switch}});
  server_.boot(settings_.address, *boot_end_);
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
  if (on == powered_) return;
  powered_ = on;
  if (on) {
    restart(true);
    return;
  }
  cut();
  state_ = State::disabled;
  boot_end_.reset();
  server_.switch_off();
}

void StandardDrive::advance(TimePoint now) {
  now = std::max(now, now_);
  for (auto next = next_event(); next <= now; next = next_event()) step(std::max(next, now_));
  step(now);
}

TimePoint StandardDrive::next_event() const {
  if (!powered_) return TimePoint::max();
  return std::min({motion_event(), late_bits_event(), server_.next_event()});
}

TimePoint StandardDrive::motion_event() const {
  if (boot_end_) return *boot_end_;
  if (!motor_.moving()) return std::min(phase_due_, settling_event());
  auto next = motor_.ends();
  if (const auto most = window(0x6065)) next = std::min(next, motor_.lags(*most + 1));
  const auto change = inputs_.next_switch(motor_.shaft(), motor_.direction());
  return change ? std::min(next, motor_.reaches(*change)) : next;
}

void StandardDrive::step(TimePoint now) {
  constexpr int following_error = 0x8611;
  now_ = now;
  const bool ended = motor_.advance(now, energised());
  follow(now);
  if (boot_end_ && now >= *boot_end_) boot_end_.reset();
  if (alive()) {
    for (const auto& edge :
         inputs_.sample(now, motor_.shaft(), {.functions = {negative_limit, positive_limit, home_switch}}))
      homing_edge(edge);
    if (const auto most = window(0x6065); most && energised() && std::llabs(motor_.lag()) > *most)
      fail_with(following_error);
    enforce_limits();
    if (ended && !motor_.moving()) on_stopped();
    if (phase_due_ <= now) next_phase();
    follow_velocity();
    // Event PDOs look when something changed; what changes with time alone they look at by themselves.
    if (const auto present = appearance(); std::exchange(appearance_, present) != present) server_.touch(now);
  }
  server_.advance(now);
}

/// Bit 10 comes with time alone.
TimePoint StandardDrive::settling_event() const {
  constexpr Duration cycle = std::chrono::milliseconds(1);
  if (!reached_ || in_position()) return TimePoint::max();
  if (in_window_since_)
    return std::max(now_ + cycle, *in_window_since_ + std::chrono::milliseconds(dictionary_.get(0x6068)));
  return encoder_.wavers(motor_) ? now_ + cycle : TimePoint::max();
}

TimePoint StandardDrive::late_bits_event() const {
  auto next = TimePoint::max();
  for (const auto due : {acknowledgement_due_, homing_bits_due_})
    if (due > now_) next = std::min(next, due);
  return next;
}

/// FFFFFFFFh switches either off.
std::optional<std::int64_t> StandardDrive::window(std::uint16_t index) const {
  constexpr std::int64_t off = 0xFFFFFFFF;
  const auto most = value(index, off);
  return most < 0 || most == off ? std::nullopt : std::optional(most);
}

/// What the load and the encoder do meanwhile.
void StandardDrive::follow(TimePoint now) {
  constexpr double settling = 30, longest = 0.025;  // counts, seconds
  auto following = encoder_.settings().following;
  if (behaviour_.settles_over_30_counts)  // at the end of a ramp it is behind by ramp x time^2
    following = std::max(following, std::chrono::round<Duration>(std::chrono::duration<double>(
                                        std::min(std::sqrt(settling / ramp(0x6084)), longest))));
  motor_.follow_within(following);
  if (!energised()) encoder_.relax();
  const bool held = motor_.blocked() || motor_.moving() || energised();
  if (const auto pulses = encoder_.slipped(now, !held); pulses != 0) motor_.push(pulses, powered_);
  watch_window();
}

/// 6067h counts from the end of the ramp on.
void StandardDrive::watch_window() {
  const auto most = window(0x6067);
  if (!reached_ || (most && std::llabs(encoder_.deviation(motor_, now_)) > *most))
    in_window_since_.reset();
  else if (!in_window_since_)
    in_window_since_ = now_;
}

bool StandardDrive::in_position() const {
  const auto most = window(0x6067);
  if (!most) return reached_;
  return in_window_since_ && now_ - *in_window_since_ >= std::chrono::milliseconds(dictionary_.get(0x6068)) &&
         std::llabs(encoder_.deviation(motor_, now_)) <= *most;
}

/// All that can change by itself and shows in mappable objects, but the position.
std::uint64_t StandardDrive::appearance() const {
  return std::uint64_t{status()} | std::uint64_t{inputs_.bits()} << 16U |
         (motor_.moving() ? std::uint64_t{1} << 32U : 0U) | static_cast<std::uint64_t>(starts_) << 33U;
}

void StandardDrive::on_frame(const can::Frame& frame) {
  if (!powered_) return;
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
  motor_.block(blocked);
  step(now_);
}

bool StandardDrive::run_at(double factor) {
  motor_.run_at(factor);
  return true;
}

bool StandardDrive::push_shaft(std::int64_t pulses) {
  if (motor_.blocked() || energised()) return false;
  motor_.push(pulses, powered_);
  server_.touch(now_);
  step(now_);
  return true;
}

bool StandardDrive::lean_on_shaft(int counts) {
  if (!energised() || !encoder_.lean(counts)) return false;
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
