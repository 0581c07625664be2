// What the drive does: by PDO where it sends them, else by SDO; and what the node says of itself.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using std::chrono::milliseconds;

constexpr auto longest_pdo_wait = milliseconds(60);
/// Of a node that is alive.
constexpr auto longest_pdo_wait_alive = milliseconds(100);
/// A reading by SDO takes some eight of them: longer than a PDO is waited for.
constexpr auto slow_answer = milliseconds(10);

}  // namespace

void Cia402Drive::on_event(const canopen::NodeEvent& event) {
  using Kind = canopen::NodeEvent::Kind;
  switch (event.kind) {
    case Kind::booted:
      contact_.booted(canary_.expects_anything());
      forget_power_cycle();
      break;
    case Kind::heartbeat_lost:
      contact_.note_heartbeat(true);
      words_.forget();
      break;
    case Kind::heartbeat_again:
      contact_.note_heartbeat(false);
      break;
    case Kind::state_changed:
      break;
  }
  give_up_common_start();
  news_.notify_all();
  if (attention_) attention_();
}

void Cia402Drive::on_emergency(const canopen::Emergency& emergency) {
  const auto group = emergency.code >> 8U;
  const bool of_communication = group == 0x81 || group == 0x82;
  if (!emergency.is_reset() && !of_communication) contact_.note_alarm(alarm_of(*model_, emergency.code));
  if (emergency.is_reset()) contact_.note_fault_left(clock_->now());
  give_up_common_start();
  news_.notify_all();
  if (attention_) attention_();
}

void Cia402Drive::on_foreign_command(const std::string& what) {
  if (!foreign_.note(what, clock_->now())) return;
  spdlog::warn("{} node {}: {}", bus_->name(), node_.id(), foreign_.text());
  if (attention_) attention_();
}

std::string Cia402Drive::link_note() const {
  const auto& of_state = state_link_.way().note();
  if (!foreign_.concerns(clock_->now())) return of_state;
  return of_state.empty() ? foreign_.text() : foreign_.text() + std::string(between_notes) + of_state;
}

/// Of a fault that 603Fh does not name, or of a drive without 603Fh.
std::uint16_t Cia402Drive::alarm_by_emergency() const {
  const auto active = bus_->master().emergencies().active(node_.id());
  const auto code = active ? alarm_of(*model_, active->code) : std::uint16_t{0};
  return code != 0 ? code : alarm_without_code;
}

bool Cia402Drive::pdos_usable() const {
  return state_link_.can_come() && !contact_.heartbeat_lost() && !contact_.rebooted();
}

/// Its heartbeat came lately: two of them are due in that time.
bool Cia402Drive::alive(TimePoint now) const {
  constexpr auto lately = milliseconds(500);
  const auto status = bus_->master().nmt().status(node_.id());
  return status.state == canopen::NmtState::operational && status.last_heard &&
         now - *status.last_heard < lately;
}

/// What a node that is alive does not send in time is mostly on its way: to ask for the same by SDO only
/// makes what comes after it later still. So such a node gets some cycles more, but where the end of a stop
/// is waited for.
Duration Cia402Drive::pdo_patience(TimePoint now) const {
  constexpr auto reply = milliseconds(10);
  constexpr int cycles_alive = 6;
  const auto& pdos = state_link_.pdos();
  if (!pdos.synchronous()) return longest_pdo_wait;
  const auto period = bus_->settings().sync_period;
  const auto wanted = pdos.late() ? std::max<Duration>(3 * period + reply, longest_pdo_wait)
                                  : std::min<Duration>(2 * period + reply, longest_pdo_wait);
  const bool stopping = words_.halt() == KnownWords::Halt::braking;
  if (!alive(now) || stopping) return wanted;
  return std::max(wanted, std::min<Duration>(cycles_alive * period + reply, longest_pdo_wait_alive));
}

/// The first complete reading that is no older than this call, if it comes soon.
Task<std::optional<Reading>> Cia402Drive::next_pdos() {
  const auto since = clock_->now();
  // A drive that does not send them costs one short wait now and then, and not with every reading.
  const bool hopeless =
      state_link_.way().fails() && !state_link_.pdos().since(since - std::chrono::seconds(1));
  if (!pdos_usable() || hopeless) co_return std::nullopt;
  const auto until = since + pdo_patience(since);
  for (bool in_time = true; in_time && pdos_usable(); in_time = co_await news_.wait_until(until)) {
    if (auto reading = state_link_.pdos().since(since)) {
      state_link_.way().came();
      co_return reading;
    }
  }
  if (pdos_usable()) state_link_.way().miss();
  co_return std::nullopt;
}

Task<Result<Reading>> Cia402Drive::poll_objects(SdoOptions options) {
  Reading reading{.asked_at = clock_->now()};
  auto objects = state_objects(*model_);
  if (model_->objects.moving) objects.push_back(*model_->objects.moving);
  for (const auto object : objects) {
    const auto value = co_await read_object(object, options);
    if (!value) co_return fail(value.error());
    reading.values[object.key()] = *value;
  }
  reading.measured_at = clock_->now();
  co_return reading;
}

/// By PDO, where they come and are wanted, else by SDO.
Task<Result<DriveSample>> Cia402Drive::look(bool by_pdo, SdoOptions options) {
  if (by_pdo)
    if (const auto reading = co_await next_pdos()) co_return judge(*reading, true);
  if (contact_.rebooted()) co_return fail(lost_memory());
  const auto polled = co_await poll_objects(options);
  if (!polled) co_return fail(polled.error());
  if (contact_.rebooted()) co_return fail(lost_memory());
  state_link_.way().polled();
  co_return judge(*polled, false);
}

/// No node waits for another here, whatever is awaited.
Task<Result<DriveSample>> Cia402Drive::read_state(TransactionClass transaction_class,
                                                  TimePoint /*awaited_from*/) {
  const SdoOptions options{.transaction_class = transaction_class};
  // A chain that starts something does not wait for a PDO, unless the objects come later still.
  const bool slow = seen_.answer_time > slow_answer;
  auto sample = co_await look(slow || transaction_class != TransactionClass::motion, options);
  // A fault that was left while the objects were read is none any more: its code is gone already, too.
  const bool over = sample && sample->alarm_code != 0 && contact_.has_left_fault_since(sample->asked_at);
  // The drive may have been reset between its status word and 603Fh: neither comes with the other.
  const bool torn = sample && sample->alarm_code == alarm_without_code && has(*model_, object::error_code);
  if (over || torn) sample = co_await look(false, options);
  // What a drive does with a change of its mode in motion is not said.
  const bool rests = sample && !sample->moving && stops_.is_after(sample->asked_at);
  if (homing_.state() == HomingRun::State::leaving && rests && !contact_.rebooted()) {
    co_await leave_homing(options);
    sample = co_await look(false, options);
  }
  if (sample && sample->alarm_code == alarm_without_code) sample->alarm_code = alarm_by_emergency();
  // An alarm that has gone already is told once, all the same (M5): with a sample that somebody gets.
  if (sample)
    if (const auto told = contact_.take_alarm(); sample->alarm_code == 0) sample->alarm_code = told;
  co_return sample;
}

bool Cia402Drive::known_by_way() const {
  return position_window() > 0 ||
         decode_velocity(*model_, setup_.pulses_per_revolution, 1) > velocity_noise_rpm;
}

DriveSample Cia402Drive::decoded(const Values& values) const {
  const auto noise = position_window() > 0 ? velocity_noise() : 0;  // else its velocities are exact, too
  return decode_state(*model_, setup_.pulses_per_revolution, values, setup_.active_low, noise);
}

/// `of_one_moment`: all of the reading's positions are.
DriveSample Cia402Drive::judge(const Reading& reading, bool of_one_moment) {
  auto sample = decoded(reading.values);
  sample.asked_at = reading.asked_at;
  sample.measured_at = reading.measured_at;
  const auto window = position_window();
  const bool says = window > 0;  // else its positions are exact, and know better
  motion_.take(
      sample,
      {.by_way = known_by_way(),
       .told = says ? told_motion(*model_, reading.values, words_.held_halt(reading.asked_at)) : std::nullopt,
       .gauge = {.window = window,
                 .pulses_per_revolution = setup_.pulses_per_revolution,
                 .noise_rpm = velocity_noise()}});
  const bool compared = window > 0 && (of_one_moment || !sample.moving);
  if (!compared) sample.commanded_pulses.reset();
  note_knowledge(reading);
  if (!sample.moving) words_.see_rest(sample.asked_at);
  // Where no bit shows it the state goes on while a terminal has released the motor.
  if (model_->status.enabled == 0 && input_active(sample, {"motor_free"})) sample.enabled = false;
  sample.mode = mode_of(sample, reading);
  // A bit that is left from an earlier homing says nothing about the last one; of CiA 402's bit 12 nothing is
  // left in another mode.
  if (may_be_neutral(reading)) sample.homed = false;
  const bool bit_fell = !sample.moving && !home_bit(*model_, reading.values).value_or(false);
  sample.homed = homing_.is_homed(sample.homed, bit_fell);
  return sample;
}

/// Whatever else is begun, or stopped, ends this: nothing of it goes out after that.
void Cia402Drive::give_up_leaving() {
  give_up_common_start();
  homing_.give_up();
  bus_->purge_superseded(node_.id(), homing_.gate());
}

/// Back to position mode, where bit 13 is the power stage alone, and bit 4 to 0; with the halt, which any
/// start ends. What fails here is done by the next start.
Task<> Cia402Drive::leave_homing(SdoOptions options) {
  options.guard = homing_.go_back();
  const auto held = co_await held_control(options);
  if (!held) co_return;
  const auto word = static_cast<std::uint16_t>((*held & control::state_bits) | control::halt);
  if (const auto written = co_await write_control(word, options); !written) co_return;
  (void)co_await change_mode(OperationMode::profile_position, std::move(options));
}

/// There, and on the way there and back, bit 12 may be that of any homing before.
bool Cia402Drive::may_be_neutral(const Reading& reading) const {
  if (model_->neutral_mode != OperationMode::homing || homing_.active()) return false;
  return words_.may_be_neutral(reading.asked_at);
}

/// 6061h stays as it is when a motion has ended; the contract wants `homing` only while it lasts.
DriveMode Cia402Drive::mode_of(const DriveSample& sample, const Reading& reading) {
  if (homing_.active()) {
    const auto bit = home_bit(*model_, reading.values);
    const bool held_up = input_active(sample, {"stop", "quick_stop"});
    const auto failed = homing_failed(*model_, reading.values);
    if (homing_.take(sample, {.low = bit == false, .held_up = held_up, .failed = failed}))
      return DriveMode::homing;
  }
  if (homing_.state() == HomingRun::State::leaving)
    return sample.moving ? DriveMode::homing : DriveMode::positioning;
  if (motion_.state() != MotionWatch::State::rest) return DriveMode::positioning;
  if (words_.homes() && sample.enabled) {
    // Found homing: between its phases the motor rests, but bit 4 stands (6.2.6).
    const auto status = reading.values.find(object::status_word.key());
    const bool told = canary_.blocks().empty() && status != reading.values.end() &&
                      (static_cast<std::uint16_t>(status->second) & model_->status.set_point_mirror) != 0;
    if (sample.moving || (told && !sample.homed)) return DriveMode::homing;
  }
  if (sample.moving)
    if (const auto terminal = terminal_motion(sample)) return *terminal;
  return DriveMode::positioning;
}

bool Cia402Drive::input_active(const DriveSample& sample,
                               std::initializer_list<std::string_view> functions) const {
  const auto& terminals = model_->descriptor->inputs;
  return std::ranges::any_of(setup_.inputs, [&](const TerminalSettings& input) {
    const auto terminal = std::ranges::find(terminals, input.terminal, &TerminalSpec::name);
    return terminal != terminals.end() && std::ranges::find(functions, input.function) != functions.end() &&
           ((sample.inputs >> static_cast<unsigned>(terminal - terminals.begin())) & 1U) != 0;
  });
}

/// A terminal that starts motions is active: the drive moves by itself, and goes on when axisd does not.
std::optional<DriveMode> Cia402Drive::terminal_motion(const DriveSample& sample) const {
  if (input_active(sample, {"homing_start"})) return DriveMode::homing;
  if (input_active(sample, {"position_start"})) return DriveMode::multi_position;
  if (input_active(sample, {"speed_start", "jog_positive", "jog_negative"})) return DriveMode::multi_velocity;
  return std::nullopt;
}

}  // namespace axisd::cia402
