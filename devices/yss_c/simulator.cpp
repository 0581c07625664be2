// Power, time, inputs and outputs of the simulated drive.
#include "devices/yss_c/simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "devices/yss_c/simulator_dictionary.hpp"

namespace axisd::yss_c {

namespace {

using simulation::SimulatedNodeSettings;

constexpr TerminalSpec input_terminals[] = {{"X0"}, {"X1"}, {"X2"}, {"X3"}, {"X4"}, {"X5"}, {"X6"}};  // 4.2.3
constexpr int dip_bauds[] = {1'000'000};  // 4.3, SW2 off
constexpr std::uint8_t last_dip_address = 15, first_custom_node = 16;
// 4.3, codes of 2009h.
constexpr std::array<std::uint32_t, 6> custom_bauds{500'000, 250'000, 125'000, 100'000, 50'000, 25'000};
// 7, codes of 2006h.
constexpr std::array<int, 16> microsteps{400,  800,  1600, 3200, 6400, 12800, 25600, 51200,
                                         1000, 2000, 4000, 5000, 8000, 10000, 20000, 40000};
/// Resetting the communication reads no EEPROM and tests nothing; the manual gives no figure.
constexpr Duration communication_reset_time = std::chrono::milliseconds(10);

SimulatedNodeSettings with_defaults(SimulatedNodeSettings settings) {
  if (!settings.dip_address)
    settings.dip_address = settings.address <= last_dip_address ? settings.address : std::uint8_t{0};
  if (settings.dip_address == 0) settings.eeprom.try_emplace(0x200800, settings.address);
  return settings;
}

simulation::PdoSettings pdos_of(const Behaviour& behaviour) {
  return {.read_only = behaviour.pdo_parameters_read_only,
          .reception = {.refused = behaviour.rpdo_sync_refused,
                        .at_once = behaviour.rpdo_type_ignored,
                        .first_counts = behaviour.rpdo_first_counts,
                        .repeated = behaviour.rpdo_repeated,
                        .kept = behaviour.rpdo_kept,
                        .applied_by_type = behaviour.rpdo_applied_by_type}};
}

simulation::CanopenServerSettings server_settings(const Behaviour& behaviour) {
  return {
      .pdos = pdos_of(behaviour),
      .sdo = {.segmented_uploads = behaviour.segmented_uploads, .shorter_writes = behaviour.shorter_writes},
      .emergency_base_alone = behaviour.emergency_cob_is_sync,
      .error_count_grows = behaviour.error_count_grows};
}

std::unique_ptr<simulation::SimulatedCanNode> make(SimulatedNodeSettings settings) {
  return std::make_unique<SimulatedDrive>(std::move(settings));
}

}  // namespace

std::span<const simulation::Simulator> simulators() {
  static const std::array<simulation::Simulator, 1> all{{{.model = "yss-c",
                                                          .make_can = &make,
                                                          .switches = switch_specs(),
                                                          .inputs = input_terminals,
                                                          .last_register = 0x60FFFF,
                                                          .maximum_dip_address = last_dip_address,
                                                          .dip_bauds = dip_bauds}}};
  return all;
}

SimulatedDrive::SimulatedDrive(SimulatedNodeSettings settings)
    : behaviour_(behaviour_from(settings.switches)),
      settings_(with_defaults(std::move(settings))),
      server_(server_settings(behaviour_), dictionary_, hooks(),
              [this](bool communication_only) { nmt_reset(communication_only); }),
      inputs_(input_terminals, {input_home, input_positive_limit, input_negative_limit}, settings_),
      encoder_(settings_.encoder, settings_.address) {
  add_rows(dictionary_, behaviour_, pdos_of(behaviour_));
  for (const auto& [key, value] : settings_.eeprom) dictionary_.preset(key, value);
  if (!settings_.powered) return;
  power_up();
  boot_end_.reset();
  server_.boot_quietly(server_.node(), now_);
  settle_inputs();
}

/// 4.3: what the switches leave open stands in the EEPROM, and counts from the next power-up.
void SimulatedDrive::set_up_from_eeprom() {
  dictionary_.power_up();
  if (behaviour_.inputs_undefined_at_power_up)
    for (std::uint8_t sub = 2; sub <= 8; ++sub) dictionary_.set(0x2030, sub, 0);
  const auto custom = static_cast<std::uint8_t>(dictionary_.get(0x2008));
  const std::uint8_t undefined = behaviour_.undefined_node_is_1 ? 1 : 0;
  const auto node = *settings_.dip_address != 0   ? *settings_.dip_address
                    : custom >= first_custom_node ? custom
                                                  : undefined;
  server_.boot(node, *boot_end_);
  rest();
}

/// 0 is on the switches: "custom", 2009h.
void SimulatedDrive::join(std::uint32_t bitrate) {
  if (!settings_.dip_baud) {
    const auto* const found = std::ranges::find(custom_bauds, bitrate);
    settings_.dip_baud = found == custom_bauds.end() ? static_cast<int>(bitrate) : 0;
    if (found != custom_bauds.end() && !settings_.eeprom.contains(0x200900))
      dictionary_.preset(0x200900, found - custom_bauds.begin());
  }
  bitrate_ = *settings_.dip_baud != 0 ? static_cast<std::uint32_t>(*settings_.dip_baud)
                                      : custom_bauds.at(static_cast<std::size_t>(dictionary_.get(0x2009)));
}

void SimulatedDrive::power_up() {
  powered_ = true;
  boot_end_ = now_ + settings_.boot_time;
  motor_.power_up();
  alarm_ = cause_;
  homed_ = false;
  set_up_from_eeprom();
  if (settings_.dip_baud) join(0);
}

/// Nothing runs and nothing waits.
void SimulatedDrive::rest() {
  state_ = alarm_ == 0 ? State::disabled : State::fault;
  control_ = 0;
  mode_ = 0;
  energised_ = reached_ = acknowledged_ = stopping_ = homing_error_ = false;
  activity_ = Activity::none;
  pending_.reset();
  suspended_.reset();
  buffered_.reset();
  velocity_held_ = false;
  clear_due_ = homing_due_ = TimePoint::max();
}

void SimulatedDrive::nmt_reset(bool communication_only) {
  if (communication_only) {
    dictionary_.power_up(0x1000, 0x1FFF);
    server_.boot(server_.node(), now_ + communication_reset_time);
    return;
  }
  cut();
  boot_end_ = now_ + settings_.boot_time;
  if (!behaviour_.nmt_reset_keeps_position) {
    motor_.power_up();
    homed_ = false;
  }
  set_up_from_eeprom();
}

void SimulatedDrive::set_power(bool on) {
  if (on == powered_) return;
  if (on) {
    power_up();
    return;
  }
  cut();
  powered_ = energised_ = false;
  boot_end_.reset();
  server_.switch_off();
}

void SimulatedDrive::advance(TimePoint now) {
  now = std::max(now, now_);
  for (auto next = next_event(); next <= now; next = next_event()) step(std::max(next, now_));
  step(now);
}

TimePoint SimulatedDrive::next_event() const {
  if (!powered_) return TimePoint::max();
  return std::min(motion_event(), server_.next_event());
}

TimePoint SimulatedDrive::motion_event() const {
  if (boot_end_) return *boot_end_;
  auto next = std::min({motor_.ends(), inputs_.next_event(), clear_due_, homing_due_});
  if (motor_.moving()) {
    const auto change = inputs_.next_switch(motor_.shaft(), motor_.direction());
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
    server_.advance(now);  // the boot-up message comes before an alarm's
    settle_inputs();
    if (alarm_ != 0) report_alarm();
  }
  if (ready()) {
    for (const auto& edge : inputs_.sample(now, motor_.shaft(), input_settings())) on_edge(edge);
    if (motor_.moving() && !energised()) cut();
    if (in_control() && std::llabs(motor_.lag()) >= deviation_limit()) show_alarm(5);
    enforce_limits();
    if (ended && !motor_.moving()) on_stopped();
    if (homing_due_ <= now) homing_stopped();
    if (clear_due_ <= now) {
      clear_due_ = TimePoint::max();
      motor_.clear_counter();
    }
    update_velocity();
    // Event PDOs look when something changed; what changes with time alone they look at by themselves.
    if (const auto now_appears = appearance(); std::exchange(appearance_, now_appears) != now_appears)
      server_.touch(now);
  }
  server_.advance(now);
}

/// What the load and the encoder do meanwhile.
void SimulatedDrive::follow(TimePoint now) {
  encoder_.set_resolution(pulses_of_counts(1));
  motor_.follow_within(closed_loop() ? encoder_.settings().following : Duration{});
  if (!in_control()) encoder_.relax();
  const bool held = motor_.blocked() || motor_.moving() || (ready() && energised());
  if (const auto pulses = encoder_.slipped(now, !held); pulses != 0)
    motor_.push(pulses, ready() && closed_loop() && !behaviour_.released_position_frozen);
}

/// All that can change by itself and shows in mappable objects, but the position.
std::uint64_t SimulatedDrive::appearance() const {
  return std::uint64_t{status()} | std::uint64_t{inputs_.bits()} << 16U | std::uint64_t{outputs()} << 24U |
         static_cast<std::uint64_t>(alarm_) << 32U | (motor_.moving() ? std::uint64_t{1} << 40U : 0U) |
         static_cast<std::uint64_t>(starts_) << 41U;
}

void SimulatedDrive::on_frame(const can::Frame& frame) {
  if (!powered_) return;
  server_.on_frame(frame, now_);
  step(now_);
}

void SimulatedDrive::settle_inputs() { inputs_.settle(motor_.shaft(), input_settings()); }

void SimulatedDrive::set_input(std::string_view terminal, std::optional<bool> active) {
  inputs_.drive(terminal, active);
  step(now_);
}

void SimulatedDrive::block_shaft(bool blocked) {
  motor_.block(blocked);
  step(now_);
}

bool SimulatedDrive::run_at(double factor) {
  motor_.run_at(factor);
  return true;
}

bool SimulatedDrive::push_shaft(std::int64_t pulses) {
  if (motor_.blocked() || (ready() && energised())) return false;
  motor_.push(pulses, ready() && closed_loop() && !behaviour_.released_position_frozen);
  server_.touch(now_);
  step(now_);
  return true;
}

bool SimulatedDrive::lean_on_shaft(int counts) {
  if (!in_control() || !encoder_.lean(counts)) return false;
  server_.touch(now_);
  step(now_);
  return true;
}

double SimulatedDrive::pulses_of_counts(double counts) const {
  return counts * pulses_per_revolution() / 4000;
}

/// In pulses. 2046h gives no unit: taken as counts of the encoder, so that its default is one revolution.
std::int64_t SimulatedDrive::deviation_limit() const {
  return dictionary_.get(0x2046) * pulses_per_revolution() / 4000 + 1;
}

/// 204Fh gives no unit: taken as counts of the encoder, as 2046h.
bool SimulatedDrive::in_position() const {
  if (!reached_ || !closed_loop()) return reached_;
  const auto window =
      static_cast<std::int64_t>(std::ceil(pulses_of_counts(static_cast<double>(dictionary_.get(0x204F)))));
  return std::llabs(encoder_.deviation(motor_, now_)) <= window;
}

int SimulatedDrive::pulses_per_revolution() const {
  return microsteps.at(static_cast<std::size_t>(dictionary_.get(0x2006)) & 15U);
}

simulation::InputSettings SimulatedDrive::input_settings() const {
  simulation::InputSettings settings;
  settings.inverted = static_cast<std::uint16_t>(dictionary_.get(0x2030, 1));
  for (std::uint8_t i = 0; i < std::size(input_terminals); ++i) {
    const auto function =
        static_cast<std::uint8_t>(dictionary_.get(0x2030, static_cast<std::uint8_t>(2 + i)));
    settings.functions.at(i) = function;
    // 4.3: a pulse must be longer than 10 ms, the default of the filters: one for two inputs, in ms.
    const bool is_switch = function >= input_home && function <= input_negative_limit;
    if (!is_switch || behaviour_.filter_home_and_limits)
      settings.filters.at(i) =
          std::chrono::milliseconds(dictionary_.get(static_cast<std::uint16_t>(0x2067 + i / 2)));
  }
  return settings;
}

/// 2003h or 2004h: `count` terminals of which some are active, inverted by 2030h:`inversion`. The maker's
/// other drives show what is active.
std::uint16_t SimulatedDrive::shown(std::uint16_t active, std::uint8_t inversion, std::size_t count) const {
  const auto inverted = behaviour_.states_are_levels ? dictionary_.get(0x2030, inversion) : 0;
  return static_cast<std::uint16_t>((active ^ inverted) & ((1 << count) - 1));
}

/// Functions 2030h:0D..0F that are active.
std::uint16_t SimulatedDrive::outputs() const {
  const std::array<bool, 5> functions{false, alarm_ != 0, motor_.moving(), homed_, in_position()};
  unsigned bits = 0;
  for (unsigned i = 0; i < 3; ++i)
    if (functions.at(static_cast<std::size_t>(dictionary_.get(0x2030, static_cast<std::uint8_t>(0x0D + i)))))
      bits |= 1U << i;
  return static_cast<std::uint16_t>(bits);
}

std::uint32_t SimulatedDrive::peek(std::uint32_t address) const {
  const auto* row =
      dictionary_.find(static_cast<std::uint16_t>(address >> 8U), static_cast<std::uint8_t>(address));
  return row == nullptr ? 0 : static_cast<std::uint32_t>(server_.objects().value(*row));
}

void SimulatedDrive::poke(std::uint32_t address, std::uint32_t value) {
  dictionary_.set(static_cast<std::uint16_t>(address >> 8U), static_cast<std::uint8_t>(address), value);
  server_.touch(now_);
  if (ready()) step(now_);
}

}  // namespace axisd::yss_c
