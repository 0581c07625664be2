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
    : context_(std::move(environment), std::move(settings), descriptor, std::move(drive), std::move(face),
               simulated),
      shaft_(context_),
      drift_(context_.settings.drift_check),
      pace_(context_.settings.poll_moving, context_.settings.poll_idle),
      eeprom_budget_(context_.settings.limits.eeprom_saves_per_day, {}),
      absolute_segments_(context_.settings.segments && context_.settings.segments->absolute),
      stop_(*context_.gate, context_.env.holds),
      wake_(context_.env.executor, *context_.env.clock),
      stopped_(context_.env.executor, *context_.env.clock),
      observed_(context_.env.stop_delays),
      speed_watch_(static_cast<double>(context_.settings.scale.pulses_per_revolution)) {
  stop_.set_deceleration(
      context_.planner.braking_time(context_.settings.limits.velocity, stop_.deceleration()));
  if (context_.env.persistence != nullptr) {
    const auto& axes = context_.env.persistence->current().axes;
    if (const auto found = axes.find(context_.settings.name); found != axes.end()) {
      eeprom_writes_ = found->second.eeprom_writes;
      eeprom_budget_ = {context_.settings.limits.eeprom_saves_per_day, found->second.eeprom};
    }
  }
  if (const auto before = context_.face->snapshot.load()) revision_ = before->revision;
  context_.drive->on_attention([this] { wake(); });
  context_.drive->ask_before_saving([this](std::uint64_t saves) { return permit_saves(saves); });
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
  spawn(context_.env.executor, counted(std::move(sequence), sequences_),
        fmt::format("{} {}", context_.settings.name, name));
}

void Axis::close() {
  // With what a start that was not sent has left in the drive. What moves comes to rest elsewhere.
  if (!life_.ends() && context_.env.persistence != nullptr && link_.is_configured() &&
      context_.drive->continuity_mark()) {
    const auto trust = at_rest() ? shaft_.tracker().trust() : PositionTrust::unknown;
    context_.env.persistence->save_offset(context_.settings.name,
                                          offset_record(shaft_.tracker().offset(), trust), {});
  }
  life_.close();
  link_.close();
  supersede(context_.error(Reason::cancelled, "the daemon ends"));
  give_up_comparison();
  publish();
  wake();
  for (auto* signal : {&shaft_.sampled(), &stopped_}) signal->notify_all();
}

bool Axis::busy() const {
  return activity_ || stop_.under_way() || stop_.owed() || shaft_.terminal_motion().moves() ||
         (shaft_.sample() && shaft_.sample()->moving);
}

bool Axis::works() const {
  const bool only_waits = bides() && !stop_.under_way() && !stop_.owed() &&
                          !shaft_.terminal_motion().moves() && !(shaft_.sample() && shaft_.sample()->moving);
  return busy() && !only_waits;
}

bool Axis::bides() const { return activity_ && activity_->start.bides(); }

bool Axis::at_rest() const {
  return !stop_.under_way() && !stop_.owed() && !(activity_ && activity_->state != AxisState::standstill) &&
         !(shaft_.sample() && shaft_.sample()->moving);
}

void Axis::on_sample(const DriveSample& sample) {
  const auto before = shaft_.sample();
  shaft_.take(sample);
  pace_.seen(sample.asked_at, sample.moving);
  if (before) tell_edges(*before, sample);
  const auto counter = shaft_.tracker().counter();
  if (!shaft_.watch().rezeroes())
    shaft_.tracker().update(sample.position_pulses, context_.drive->position_window());
  const auto turned_by = shaft_.tracker().counter() - counter;
  // What nothing holds may be turned by hand, and back again.
  if (sample.moving || !sample.enabled) shaft_.tracker().forget_base();
  const auto facts = shaft_facts();
  shaft_.watch().look(sample, facts);
  if (shaft_.watch().shows_loss(before, sample, facts)) lose_trust();
  if (sample.alarm_code != 0) on_alarm(sample);
  if (before && shaft_.watch().hides_loss(*before, sample, turned_by, facts)) lose_trust();
  if (!sample.enabled) on_released(sample, before && before->enabled);
  watch_speed(SpeedWatch::Event::sampled);
  // A drive that cannot tell yet whether it rests is shown as moving, without speed or way. A measured shaft
  // that is elsewhere may only have settled there from the motion before.
  const auto window = context_.drive->position_window();
  const bool began = stop_.unseen_start().look(
      {.asked_at = sample.asked_at,
       .moving = sample.moving && (sample.velocity_rpm != 0 || std::abs(turned_by) > window),
       .elsewhere = window == 0 && shaft_.moved_from(stop_.unseen_start().base())});
  // A stop from before it began may have been ignored.
  if (began && stop_.under_way()) stop_.ask(StopKind::halt);
  // What a link that failed kept back was not heard, wherever the drive rests.
  const bool rests = !sample.moving && !stop_.unseen_start().may_begin();
  if (rests && link_.online() && !link_.bus_loss()) stop_.seen_at_rest();
  if (link_.online())
    observed_.on_sample(sample, busy());
  else
    observed_.interrupted();
  if (!sample.moving) shaft_.terminal_motion().at_rest();
  const bool explained = activity_ && !activity_->start.sends_nothing();
  if (sample.moving && !explained && !stop_.under_way() && link_.online())
    on_unexplained_motion(sample, before);
  release_as_owed();
  publish();
  sampled_revision_ = revision_;
  shaft_.sampled().notify_all();
}

/// What decides with the newest reading whether the position can still be believed.
ShaftWatch::Facts Axis::shaft_facts() const {
  return {.inverted = context_.settings.scale.invert,
          .closed_loop = context_.drive->closed_loop(),
          .counts_released = context_.counts_while_released(),
          .homes = activity_ && activity_->state == AxisState::homing,
          .ours = stop_.left_running() || (activity_ && activity_->start.has_begun()),
          .positive_limit = shaft_.limit_active(true),
          .negative_limit = shaft_.limit_active(false),
          .quick_stop = shaft_.input_active("quick_stop"),
          .homing_terminal = context_.terminals.has("homing_start"),
          .window = context_.drive->position_window(),
          .noise = context_.settings.scale.pulses_per_revolution / 500,
          .settling = context_.settling()};
}

void Axis::on_alarm(const DriveSample& sample) {
  if (fault_ && fault_->reason == Reason::alarm && fault_->where.native_code == sample.alarm_code) return;
  lose_trust();
  enter_error_stop(context_.alarm_error(sample.alarm_code, "the drive reports"));
  // Also for an alarm that clears itself: nothing may go on by itself when it does (M5).
  begin_stop(StopKind::stop, nullptr);
}

void Axis::on_released(const DriveSample& sample, bool enabled_before) {
  // What nothing holds can be turned by hand.
  if (!context_.counts_while_released() && sample.alarm_code == 0 &&
      shaft_.tracker().trust() != PositionTrust::unknown)
    lose_trust();
  if (!power_.released(enabled_before)) return;
  const bool releasing = activity_ && activity_->command->value().kind == CommandKind::disable;
  if (releasing || fault_) return;
  const bool moved = activity_ && activity_->state != AxisState::standstill;
  if (moved && shaft_.limit_active(shaft_.watch().positive())) {
    supersede(context_.error(Reason::limit_switch,
                             "a limit switch ended the motion, and the drive released the motor",
                             "move away from it by hand; home the axis"));
  } else {
    supersede(context_.error(Reason::terminal, "the power stage was released, and not by a command",
                             "check terminals with the function motor_free and other masters on the bus"));
  }
  // As abort_at_rest(): the terminal may let go of the drive again.
  if (moved) begin_stop(StopKind::halt, nullptr);
}

void Axis::on_unexplained_motion(const DriveSample& sample, const std::optional<DriveSample>& before) {
  // The drive says so itself, or a terminal that starts motions is, or was just now, active.
  const bool segments = sample.mode == DriveMode::multi_position || sample.mode == DriveMode::multi_velocity;
  const bool homing = sample.mode == DriveMode::homing && context_.terminals.has("homing_start");
  const bool started =
      context_.terminals.start_active(sample) || (before && context_.terminals.start_active(*before));
  using Verdict = TerminalMotion::Verdict;
  switch (shaft_.terminal_motion().judge({.told_to_stop = stop_.owed() || fault_,
                                          .terminals_start = context_.terminals.may_start_motion(),
                                          .just_began = before && !before->moving,
                                          .shown = segments || homing || started,
                                          .by_itself = context_.drive->moves_by_itself()})) {
    case Verdict::known:
      return;
    case Verdict::look_again:
      return wake();
    case Verdict::begins:
      if (context_.terminals.active(sample, "homing_start") ||
          (before && context_.terminals.active(*before, "homing_start")))
        lose_trust();
      return;
    case Verdict::nobodys:
      break;
  }
  log_about_axis(spdlog::level::warn, LogKind::moving_without_command, context_.settings,
                 fmt::format("{}: moving without a command; stopping it", context_.settings.name));
  if (activity_) supersede(context_.moved_before_start());
  begin_stop(StopKind::stop, nullptr);
}

void Axis::lose_trust() {
  shaft_.tracker().forget_base();
  // What is being set was meant for the shaft as it stood, also where the counter shows the same again.
  if (activity_ && activity_->command->value().kind == CommandKind::set_position)
    finish(*activity_, [this](CommandRecord& command) {
      command.error(context_.error(Reason::moving, "the axis lost its position while another was being set",
                                   "repeat it at standstill"));
    });
  if (shaft_.tracker().trust() == PositionTrust::unknown) return;
  shaft_.tracker().lose_trust();
  if (context_.env.persistence != nullptr)
    forget_position(*context_.env.persistence, context_.settings.name,
                    power_.state() == PowerMachine::State::restarted);
}

OffsetRecord Axis::offset_record(std::int64_t offset, PositionTrust trust) const {
  // The record speaks of the 32-bit counter: unwrapping begins anew with each start of the daemon.
  // A measured position may not have settled yet.
  const auto counter = shaft_.tracker().resting_counter();
  const auto raw = static_cast<std::int32_t>(counter);
  OffsetRecord record{.offset_pulses = offset + counter - raw,
                      .trust = trust,
                      .last_position_pulses = raw,
                      .pulses_per_revolution = context_.settings.scale.pulses_per_revolution,
                      .invert = context_.settings.scale.invert};
  if (const auto mark = context_.drive->continuity_mark()) record.canary = *mark;
  if (power_.state() == PowerMachine::State::restarted) record.canary = restart_mark();
  return record;
}

void Axis::remember_position() {
  if (context_.env.persistence == nullptr || shaft_.tracker().trust() == PositionTrust::unknown) return;
  context_.env.persistence->save_offset(
      context_.settings.name, offset_record(shaft_.tracker().offset(), shaft_.tracker().trust()), {});
}

AxisState Axis::state() const {
  StateSources sources{.fault = fault_.has_value(), .stop = stop_.shown()};
  if (activity_) sources.executed = activity_->state;
  if (shaft_.sample()) sources.energised = shaft_.sample()->enabled;
  if (shaft_.sample() && shaft_.terminal_motion().moves()) sources.moved_by_terminal = shaft_.sample()->mode;
  return plcopen_state(sources);
}

}  // namespace axisd
