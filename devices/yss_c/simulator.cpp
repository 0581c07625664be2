// Power, time, inputs and outputs of the simulated drive.
#include "devices/yss_c/simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "devices/yss_c/simulator_dictionary.hpp"
#include "devices/yss_c/simulator_rates.hpp"

namespace axisd::yss_c {

namespace {

using simulation::SimulatedNodeSettings;

constexpr TerminalSpec input_terminals[] = {{"X0"}, {"X1"}, {"X2"}, {"X3"}, {"X4"}, {"X5"}, {"X6"}};  // 4.2.3
constexpr int dip_bauds[] = {1'000'000};  // 4.3, SW2 off
constexpr std::uint8_t last_dip_address = 15, first_custom_node = 16;
// 4.3, codes of 2009h.
constexpr std::array<std::uint32_t, 6> custom_bauds{500'000, 250'000, 125'000, 100'000, 50'000, 25'000};
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
      shaft_(settings_.encoder, settings_.address),
      motion_(shaft_.motor()),
      homing_(behaviour_, dictionary_, inputs_, shaft_.motor()) {
  add_rows(dictionary_, behaviour_, pdos_of(behaviour_));
  for (const auto& [key, value] : settings_.eeprom) dictionary_.preset(key, value);
  if (!settings_.powered) return;
  power_up();
  supply_.skip_boot();
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
  server_.boot(node, *supply_.boot_end());
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
  supply_.boot(now_ + settings_.boot_time);
  motor().power_up();
  alarm_.power_up();
  homing_.forget();
  set_up_from_eeprom();
  if (settings_.dip_baud) join(0);
}

/// Nothing runs and nothing waits.
void SimulatedDrive::rest() {
  control_.reset(alarm_.on() ? PowerState::fault : PowerState::disabled, 0);
  energised_ = reached_ = false;
  motion_.rest();
  set_points_.drop_all();
  set_points_.end_acknowledgement();
  velocity_.release();
  shaft_.forget_clearing();
  homing_.end_pause();
  homing_.set_failed(false);
}

void SimulatedDrive::nmt_reset(bool communication_only) {
  if (communication_only) {
    dictionary_.power_up(0x1000, 0x1FFF);
    server_.boot(server_.node(), now_ + communication_reset_time);
    return;
  }
  cut();
  supply_.boot(now_ + settings_.boot_time);
  if (!behaviour_.nmt_reset_keeps_position) {
    motor().power_up();
    homing_.forget();
  }
  set_up_from_eeprom();
}

void SimulatedDrive::set_power(bool on) {
  if (on == supply_.on()) return;
  if (on) {
    power_up();
    return;
  }
  cut();
  energised_ = false;
  supply_.switch_off();
  server_.switch_off();
}

void SimulatedDrive::advance(TimePoint now) {
  now = std::max(now, now_);
  for (auto next = next_event(); next <= now; next = next_event()) step(std::max(next, now_));
  step(now);
}

TimePoint SimulatedDrive::next_event() const {
  if (!supply_.on()) return TimePoint::max();
  return std::min(motion_event(), server_.next_event());
}

TimePoint SimulatedDrive::motion_event() const {
  if (const auto end = supply_.boot_end()) return *end;
  auto next = std::min({motor().ends(), inputs_.next_event(), shaft_.clear_due(), homing_.due()});
  if (motor().moving()) {
    const auto change = inputs_.next_switch(motor().shaft(), motor().direction());
    if (change) next = std::min(next, motor().reaches(*change));
    if (in_control()) next = std::min(next, motor().lags(deviation_limit()));
  }
  return next;
}

void SimulatedDrive::step(TimePoint now) {
  now_ = now;
  const bool ended = motor().advance(now, in_control());
  follow(now);
  if (supply_.booted(now)) {
    server_.advance(now);  // the boot-up message comes before an alarm's
    settle_inputs();
    if (alarm_.on()) report_alarm();
  }
  if (ready()) {
    for (const auto& edge : inputs_.sample(now, motor().shaft(), input_settings())) on_edge(edge);
    if (motor().moving() && !energised()) cut();
    if (in_control() && std::llabs(motor().lag()) >= deviation_limit()) show_alarm(5);
    enforce_limits();
    if (ended && !motor().moving()) on_stopped();
    if (homing_.due() <= now && homing_.on_stopped(now)) finish();
    if (shaft_.clear_due() <= now) {
      shaft_.forget_clearing();
      motor().clear_counter();
    }
    update_velocity();
    // Event PDOs look when something changed; what changes with time alone they look at by themselves.
    if (const auto now_appears = appearance(); std::exchange(appearance_, now_appears) != now_appears)
      server_.touch(now);
  }
  server_.advance(now);
}

simulation::Hold SimulatedDrive::hold() const {
  return {.in_control = in_control(),
          .energised = ready() && energised(),
          .seen = ready() && closed_loop() && !behaviour_.released_position_frozen};
}

/// What the load and the encoder do meanwhile.
void SimulatedDrive::follow(TimePoint now) {
  shaft_.encoder().set_resolution(pulses_of_counts(1));
  shaft_.follow(now, hold(), closed_loop() ? shaft_.encoder().settings().following : Duration{});
}

/// All that can change by itself and shows in mappable objects, but the position.
std::uint64_t SimulatedDrive::appearance() const {
  return std::uint64_t{status()} | std::uint64_t{inputs_.bits()} << 16U | std::uint64_t{outputs()} << 24U |
         static_cast<std::uint64_t>(alarm_.shown()) << 32U |
         (motor().moving() ? std::uint64_t{1} << 40U : 0U) |
         static_cast<std::uint64_t>(motion_.starts()) << 41U;
}

void SimulatedDrive::on_frame(const can::Frame& frame) {
  if (!supply_.on()) return;
  server_.on_frame(frame, now_);
  step(now_);
}

void SimulatedDrive::settle_inputs() { inputs_.settle(motor().shaft(), input_settings()); }

void SimulatedDrive::set_input(std::string_view terminal, std::optional<bool> active) {
  inputs_.drive(terminal, active);
  step(now_);
}

void SimulatedDrive::block_shaft(bool blocked) {
  motor().block(blocked);
  step(now_);
}

bool SimulatedDrive::run_at(double factor) {
  motor().run_at(factor);
  return true;
}

bool SimulatedDrive::push_shaft(std::int64_t pulses) {
  if (!shaft_.push(pulses, hold())) return false;
  server_.touch(now_);
  step(now_);
  return true;
}

bool SimulatedDrive::lean_on_shaft(int counts) {
  if (!shaft_.lean(counts, hold())) return false;
  server_.touch(now_);
  step(now_);
  return true;
}

double SimulatedDrive::pulses_of_counts(double counts) const {
  return counts * pulses_per_revolution(dictionary_) / 4000;
}

/// In pulses. 2046h gives no unit: taken as counts of the encoder, so that its default is one revolution.
std::int64_t SimulatedDrive::deviation_limit() const {
  return dictionary_.get(0x2046) * pulses_per_revolution(dictionary_) / 4000 + 1;
}

/// 204Fh gives no unit: taken as counts of the encoder, as 2046h.
bool SimulatedDrive::in_position() const {
  if (!reached_ || !closed_loop()) return reached_;
  const auto window =
      static_cast<std::int64_t>(std::ceil(pulses_of_counts(static_cast<double>(dictionary_.get(0x204F)))));
  return shaft_.within(window, now_);
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
  const std::array<bool, 5> functions{false, alarm_.on(), motor().moving(), homing_.homed(), in_position()};
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
