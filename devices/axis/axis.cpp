#include "devices/axis/axis.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdlib>

#include "devices/alarm_text.hpp"
#include "devices/axis/axis_log.hpp"
#include "devices/axis/plcopen_state.hpp"
#include "devices/axis/restart_mark.hpp"
#include "devices/released_position.hpp"

namespace axisd {

Axis::Axis(AxisEnvironment environment, AxisSettings settings, const DriveDescriptor& descriptor,
           std::unique_ptr<Drive> drive, AxisFacePtr face, bool simulated)
    : env_(std::move(environment)),
      settings_(std::move(settings)),
      descriptor_(&descriptor),
      scale_(settings_.scale),
      terminals_(settings_, descriptor),
      planner_(settings_, descriptor, scale_),
      tracker_(scale_),
      drive_(std::move(drive)),
      face_(std::move(face)),
      gate_(face_->gate),
      simulated_(simulated),
      drift_(settings_.drift_check),
      pace_(settings_.poll_moving, settings_.poll_idle),
      eeprom_budget_(settings_.limits.eeprom_saves_per_day, {}),
      absolute_segments_(settings_.segments && settings_.segments->absolute),
      stop_(*gate_, env_.holds),
      sampled_(env_.executor, *env_.clock),
      wake_(env_.executor, *env_.clock),
      stopped_(env_.executor, *env_.clock),
      observed_(env_.stop_delays),
      speed_watch_(static_cast<double>(settings_.scale.pulses_per_revolution)) {
  stop_.set_deceleration(planner_.braking_time(settings_.limits.velocity, stop_.deceleration()));
  if (env_.persistence != nullptr) {
    const auto& axes = env_.persistence->current().axes;
    if (const auto found = axes.find(settings_.name); found != axes.end()) {
      eeprom_writes_ = found->second.eeprom_writes;
      eeprom_budget_ = {settings_.limits.eeprom_saves_per_day, found->second.eeprom};
    }
  }
  if (const auto before = face_->snapshot.load()) revision_ = before->revision;
  drive_->on_attention([this] { wake(); });
  drive_->ask_before_saving([this](std::uint64_t saves) { return permit_saves(saves); });
  publish();
}

Axis::~Axis() = default;

void Axis::start(bool answered) {
  if (answered) link_.answers();
  take_over();
  launch(run(), "link");
}

void Axis::launch(Task<> sequence, const char* name) {
  ++sequences_;
  auto counted = [](Task<> inner, int& count) -> Task<> {
    co_await std::move(inner);
    --count;
  };
  spawn(env_.executor, counted(std::move(sequence), sequences_), fmt::format("{} {}", settings_.name, name));
}

void Axis::close() {
  // With what a start that was not sent has left in the drive. What moves comes to rest elsewhere.
  if (!life_.ends() && env_.persistence != nullptr && link_.is_configured() && drive_->continuity_mark()) {
    const auto trust = at_rest() ? tracker_.trust() : PositionTrust::unknown;
    env_.persistence->save_offset(settings_.name, offset_record(tracker_.offset(), trust), {});
  }
  life_.close();
  link_.close();
  supersede(error(Reason::cancelled, "the daemon ends"));
  give_up_comparison();
  publish();
  wake();
  for (auto* signal : {&sampled_, &stopped_}) signal->notify_all();
}

Error Axis::error(Reason reason, std::string message, std::string remedy) const {
  return {.reason = reason,
          .message = fmt::format("{}: {}", settings_.name, message),
          .remedy = std::move(remedy),
          .where = {.bus = settings_.bus, .node = settings_.node}};
}

bool Axis::busy() const {
  return activity_ || stop_.under_way() || stop_.owed() || terminal_motion_.moves() ||
         (sample_ && sample_->moving);
}

bool Axis::works() const {
  const bool only_waits = bides() && !stop_.under_way() && !stop_.owed() && !terminal_motion_.moves() &&
                          !(sample_ && sample_->moving);
  return busy() && !only_waits;
}

bool Axis::bides() const { return activity_ && activity_->start.bides(); }

bool Axis::at_rest() const {
  return !stop_.under_way() && !stop_.owed() && !(activity_ && activity_->state != AxisState::standstill) &&
         !(sample_ && sample_->moving);
}

std::int64_t Axis::home_offset() const {
  return scale_.to_pulses(settings_.homing ? settings_.homing->position : 0);
}

bool Axis::is_from_home(std::int64_t offset) const {
  return std::abs(offset - home_offset()) <= drive_->position_window();
}

bool Axis::input_active(std::string_view function) const {
  return sample_ && terminals_.active(*sample_, function);
}

bool Axis::counts_while_released() const {
  return drive_->closed_loop() && counts_released(*descriptor_, settings_.model_settings);
}

bool Axis::terminal_may_void_position() const {
  return terminals_.has("homing_start") || (terminals_.has("motor_free") && !counts_while_released());
}

bool Axis::limit_active(bool positive) const {
  return input_active(positive ? "positive_limit" : "negative_limit");
}

void Axis::on_sample(const DriveSample& sample) {
  const auto before = sample_;
  sample_ = sample;
  pace_.seen(sample.asked_at, sample.moving);
  if (before) tell_edges(*before, sample);
  const auto counter = tracker_.counter();
  if (!shaft_.rezeroes()) tracker_.update(sample.position_pulses, drive_->position_window());
  const auto turned_by = tracker_.counter() - counter;
  // What nothing holds may be turned by hand, and back again.
  if (sample.moving || !sample.enabled) tracker_.forget_base();
  const auto facts = shaft_facts();
  shaft_.look(sample, facts);
  if (shaft_.shows_loss(before, sample, facts)) lose_trust();
  if (sample.alarm_code != 0) on_alarm(sample);
  if (before && shaft_.hides_loss(*before, sample, turned_by, facts)) lose_trust();
  if (!sample.enabled) on_released(sample, before && before->enabled);
  watch_speed(SpeedWatch::Event::sampled);
  // A drive that cannot tell yet whether it rests is shown as moving, without speed or way. A measured shaft
  // that is elsewhere may only have settled there from the motion before.
  const auto window = drive_->position_window();
  const bool began = stop_.unseen_start().look(
      {.asked_at = sample.asked_at,
       .moving = sample.moving && (sample.velocity_rpm != 0 || std::abs(turned_by) > window),
       .elsewhere = window == 0 && moved_from(stop_.unseen_start().base())});
  // A stop from before it began may have been ignored.
  if (began && stop_.under_way()) stop_.ask(StopKind::halt);
  // What a link that failed kept back was not heard, wherever the drive rests.
  const bool rests = !sample.moving && !stop_.unseen_start().may_begin();
  if (rests && link_.online() && !link_.bus_loss()) stop_.seen_at_rest();
  if (link_.online())
    observed_.on_sample(sample, busy());
  else
    observed_.interrupted();
  if (!sample.moving) terminal_motion_.at_rest();
  const bool explained = activity_ && !activity_->start.sends_nothing();
  if (sample.moving && !explained && !stop_.under_way() && link_.online())
    on_unexplained_motion(sample, before);
  release_as_owed();
  publish();
  sampled_revision_ = revision_;
  sampled_.notify_all();
}

/// What decides with the newest reading whether the position can still be believed.
ShaftWatch::Facts Axis::shaft_facts() const {
  return {.inverted = settings_.scale.invert,
          .closed_loop = drive_->closed_loop(),
          .counts_released = counts_while_released(),
          .homes = activity_ && activity_->state == AxisState::homing,
          .ours = stop_.left_running() || (activity_ && activity_->start.has_begun()),
          .positive_limit = limit_active(true),
          .negative_limit = limit_active(false),
          .quick_stop = input_active("quick_stop"),
          .homing_terminal = terminals_.has("homing_start"),
          .window = drive_->position_window(),
          .noise = settings_.scale.pulses_per_revolution / 500,
          .settling = settling()};
}

Error Axis::alarm_error(std::uint16_t code, std::string_view what) const {
  const auto* spec = find_alarm(*descriptor_, code);
  auto cause =
      error(Reason::alarm,
            fmt::format("{} alarm {} ({})", what, alarm_text(code), spec != nullptr ? spec->name : "unknown"),
            spec != nullptr ? std::string(spec->remedy) : "see the drive's manual");
  cause.where.native_code = code;
  return cause;
}

void Axis::on_alarm(const DriveSample& sample) {
  if (fault_ && fault_->reason == Reason::alarm && fault_->where.native_code == sample.alarm_code) return;
  lose_trust();
  enter_error_stop(alarm_error(sample.alarm_code, "the drive reports"));
  // Also for an alarm that clears itself: nothing may go on by itself when it does (M5).
  begin_stop(StopKind::stop, nullptr);
}

void Axis::on_released(const DriveSample& sample, bool enabled_before) {
  // What nothing holds can be turned by hand.
  if (!counts_while_released() && sample.alarm_code == 0 && tracker_.trust() != PositionTrust::unknown)
    lose_trust();
  if (!power_.released(enabled_before)) return;
  const bool releasing = activity_ && activity_->command->value().kind == CommandKind::disable;
  if (releasing || fault_) return;
  const bool moved = activity_ && activity_->state != AxisState::standstill;
  if (moved && limit_active(shaft_.positive())) {
    supersede(error(Reason::limit_switch, "a limit switch ended the motion, and the drive released the motor",
                    "move away from it by hand; home the axis"));
  } else {
    supersede(error(Reason::terminal, "the power stage was released, and not by a command",
                    "check terminals with the function motor_free and other masters on the bus"));
  }
  // As abort_at_rest(): the terminal may let go of the drive again.
  if (moved) begin_stop(StopKind::halt, nullptr);
}

void Axis::on_unexplained_motion(const DriveSample& sample, const std::optional<DriveSample>& before) {
  // The drive says so itself, or a terminal that starts motions is, or was just now, active.
  const bool segments = sample.mode == DriveMode::multi_position || sample.mode == DriveMode::multi_velocity;
  const bool homing = sample.mode == DriveMode::homing && terminals_.has("homing_start");
  const bool started = terminals_.start_active(sample) || (before && terminals_.start_active(*before));
  using Verdict = TerminalMotion::Verdict;
  switch (terminal_motion_.judge({.told_to_stop = stop_.owed() || fault_,
                                  .terminals_start = terminals_.may_start_motion(),
                                  .just_began = before && !before->moving,
                                  .shown = segments || homing || started,
                                  .by_itself = drive_->moves_by_itself()})) {
    case Verdict::known:
      return;
    case Verdict::look_again:
      return wake();
    case Verdict::begins:
      if (terminals_.active(sample, "homing_start") || (before && terminals_.active(*before, "homing_start")))
        lose_trust();
      return;
    case Verdict::nobodys:
      break;
  }
  log_about_axis(spdlog::level::warn, LogKind::moving_without_command, settings_,
                 fmt::format("{}: moving without a command; stopping it", settings_.name));
  if (activity_) supersede(moved_before_start());
  begin_stop(StopKind::stop, nullptr);
}

void Axis::lose_trust() {
  tracker_.forget_base();
  // What is being set was meant for the shaft as it stood, also where the counter shows the same again.
  if (activity_ && activity_->command->value().kind == CommandKind::set_position)
    finish(*activity_, [this](CommandRecord& command) {
      command.error(error(Reason::moving, "the axis lost its position while another was being set",
                          "repeat it at standstill"));
    });
  if (tracker_.trust() == PositionTrust::unknown) return;
  tracker_.lose_trust();
  if (env_.persistence != nullptr)
    forget_position(*env_.persistence, settings_.name, power_.state() == PowerMachine::State::restarted);
}

OffsetRecord Axis::offset_record(std::int64_t offset, PositionTrust trust) const {
  // The record speaks of the 32-bit counter: unwrapping begins anew with each start of the daemon.
  // A measured position may not have settled yet.
  const auto counter = tracker_.resting_counter();
  const auto raw = static_cast<std::int32_t>(counter);
  OffsetRecord record{.offset_pulses = offset + counter - raw,
                      .trust = trust,
                      .last_position_pulses = raw,
                      .pulses_per_revolution = settings_.scale.pulses_per_revolution,
                      .invert = settings_.scale.invert};
  if (const auto mark = drive_->continuity_mark()) record.canary = *mark;
  if (power_.state() == PowerMachine::State::restarted) record.canary = restart_mark();
  return record;
}

void Axis::remember_position() {
  if (env_.persistence == nullptr || tracker_.trust() == PositionTrust::unknown) return;
  env_.persistence->save_offset(settings_.name, offset_record(tracker_.offset(), tracker_.trust()), {});
}

AxisState Axis::state() const {
  StateSources sources{.fault = fault_.has_value(), .stop = stop_.shown()};
  if (activity_) sources.executed = activity_->state;
  if (sample_) sources.energised = sample_->enabled;
  if (sample_ && terminal_motion_.moves()) sources.moved_by_terminal = sample_->mode;
  return plcopen_state(sources);
}

}  // namespace axisd
