#include "devices/axis/readings.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "devices/axis/axis_log.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/lease_duty.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/state_reader.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

namespace {

/// r/min, the fastest of all that the drive may use for it: homing has two velocities and a start speed, and
/// backs off with the plan's.
double fastest_of(const Activity& activity, const AxisSettings& settings, const Scale& scale) {
  auto fastest = std::abs(static_cast<double>(activity.plan.velocity_rpm));
  if (activity.state != AxisState::homing || !settings.homing) return fastest;
  fastest = std::max(fastest, static_cast<double>(settings.limits.start_speed_rpm));
  for (const auto velocity : {settings.homing->velocity, settings.homing->search_velocity})
    fastest = std::max(fastest, std::abs(scale.velocity_to_rpm(velocity)));
  return fastest;
}

bool has_velocity_unit(const DriveDescriptor& drive) {
  return std::ranges::find(drive.settings, std::string_view("velocity_unit"), &SettingSpec::key) !=
         drive.settings.end();
}

/// "60 r/min (10 mm/s)".
std::string text_of(double pulses_per_second, const Scale& scale) {
  const auto& settings = scale.settings();
  const auto rpm = pulses_per_second * 60 / static_cast<double>(settings.pulses_per_revolution);
  return fmt::format("{:.0f} r/min ({:.4g} {}/s)", rpm, std::abs(scale.velocity_to_units(rpm)),
                     settings.unit);
}

}  // namespace

void Readings::on_sample(const DriveSample& sample) {
  const auto before = shaft_.sample();
  shaft_.take(sample);
  reader_.pace().seen(sample.asked_at, sample.moving);
  if (before) publisher_.tell_edges(*before, sample);
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
    stopper_.observed().on_sample(sample, execution_.busy());
  else
    stopper_.observed().interrupted();
  if (!sample.moving) shaft_.terminal_motion().at_rest();
  const bool explained = execution_.activity() && !execution_.activity()->start.sends_nothing();
  if (sample.moving && !explained && !stop_.under_way() && link_.online())
    on_unexplained_motion(sample, before);
  lease_.release_as_owed();
  publisher_.publish();
  publisher_.note_sampled();
  shaft_.sampled().notify_all();
}

/// What decides with the newest reading whether the position can still be believed.
ShaftWatch::Facts Readings::shaft_facts() const {
  return {.inverted = context_.settings.scale.invert,
          .closed_loop = context_.drive->closed_loop(),
          .counts_released = context_.counts_while_released(),
          .homes = execution_.activity() && execution_.activity()->state == AxisState::homing,
          .ours = stop_.left_running() || (execution_.activity() && execution_.activity()->start.has_begun()),
          .positive_limit = shaft_.limit_active(true),
          .negative_limit = shaft_.limit_active(false),
          .quick_stop = shaft_.input_active("quick_stop"),
          .homing_terminal = context_.terminals.has("homing_start"),
          .window = context_.drive->position_window(),
          .noise = context_.settings.scale.pulses_per_revolution / 500,
          .settling = context_.settling()};
}

void Readings::on_alarm(const DriveSample& sample) {
  if (execution_.fault() && execution_.fault()->reason == Reason::alarm &&
      execution_.fault()->where.native_code == sample.alarm_code)
    return;
  lose_trust();
  execution_.enter_error_stop(context_.alarm_error(sample.alarm_code, "the drive reports"));
  // Also for an alarm that clears itself: nothing may go on by itself when it does (M5).
  stopper_.begin_stop(StopKind::stop, nullptr);
}

void Readings::on_released(const DriveSample& sample, bool enabled_before) {
  // What nothing holds can be turned by hand.
  if (!context_.counts_while_released() && sample.alarm_code == 0 &&
      shaft_.tracker().trust() != PositionTrust::unknown)
    lose_trust();
  if (!power_.released(enabled_before)) return;
  const bool releasing =
      execution_.activity() && execution_.activity()->command->value().kind == CommandKind::disable;
  if (releasing || execution_.fault()) return;
  const bool moved = execution_.activity() && execution_.activity()->state != AxisState::standstill;
  if (moved && shaft_.limit_active(shaft_.watch().positive())) {
    execution_.supersede(context_.error(Reason::limit_switch,
                                        "a limit switch ended the motion, and the drive released the motor",
                                        "move away from it by hand; home the axis"));
  } else {
    execution_.supersede(
        context_.error(Reason::terminal, "the power stage was released, and not by a command",
                       "check terminals with the function motor_free and other masters on the bus"));
  }
  // As abort_at_rest(): the terminal may let go of the drive again.
  if (moved) stopper_.begin_stop(StopKind::halt, nullptr);
}

void Readings::on_unexplained_motion(const DriveSample& sample, const std::optional<DriveSample>& before) {
  // The drive says so itself, or a terminal that starts motions is, or was just now, active.
  const bool segments = sample.mode == DriveMode::multi_position || sample.mode == DriveMode::multi_velocity;
  const bool homing = sample.mode == DriveMode::homing && context_.terminals.has("homing_start");
  const bool started =
      context_.terminals.start_active(sample) || (before && context_.terminals.start_active(*before));
  using Verdict = TerminalMotion::Verdict;
  switch (shaft_.terminal_motion().judge({.told_to_stop = stop_.owed() || execution_.fault(),
                                          .terminals_start = context_.terminals.may_start_motion(),
                                          .just_began = before && !before->moving,
                                          .shown = segments || homing || started,
                                          .by_itself = context_.drive->moves_by_itself()})) {
    case Verdict::known:
      return;
    case Verdict::look_again:
      return reader_.wake();
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
  if (execution_.activity()) execution_.supersede(context_.moved_before_start());
  stopper_.begin_stop(StopKind::stop, nullptr);
}

void Readings::lose_trust() {
  shaft_.tracker().forget_base();
  // What is being set was meant for the shaft as it stood, also where the counter shows the same again.
  if (execution_.activity() && execution_.activity()->command->value().kind == CommandKind::set_position)
    execution_.finish(*execution_.activity(), [this](CommandRecord& command) {
      command.error(context_.error(Reason::moving, "the axis lost its position while another was being set",
                                   "repeat it at standstill"));
    });
  if (shaft_.tracker().trust() == PositionTrust::unknown) return;
  shaft_.tracker().lose_trust();
  saved_.void_saved_position();
}

/// Only what axisd has started: what a terminal started, or a hand turns, was told nothing. The position is
/// lost with it: what a pulse is to the drive may not be what the configuration says (M20 has it lost with a
/// microstep that changed), and an open loop may not have followed at such a speed.
bool Readings::watch_speed(SpeedWatch::Event event) {
  if (!shaft_.sample()) return false;
  const SpeedWatch::Reading reading{.asked_at = shaft_.sample()->asked_at,
                                    .measured_at = shaft_.sample()->measured_at,
                                    .pulses = shaft_.sample()->position_pulses,
                                    .moving = shaft_.sample()->moving};
  const bool under_way = execution_.activity() && execution_.activity()->start.has_begun();
  if (!under_way) {
    speed_watch_.rest(reading);
    return false;
  }
  if (event == SpeedWatch::Event::begun) {
    const auto per_rpm = static_cast<double>(context_.settings.scale.pulses_per_revolution) / 60;
    speed_watch_.begin(reading,
                       fastest_of(*execution_.activity(), context_.settings, context_.scale) * per_rpm);
    return false;
  }
  const bool found =
      event == SpeedWatch::Event::arrived ? speed_watch_.arrive(reading) : speed_watch_.follow(reading);
  if (!found) return false;
  lose_trust();
  execution_.fail_with_stop(
      *execution_.activity(),
      context_.error(
          Reason::misconfigured,
          fmt::format("the shaft turned at {} or more, but was told to turn at {} at most; most likely the "
                      "units of the axis are not those of the drive",
                      text_of(speed_watch_.seen(), context_.scale),
                      text_of(speed_watch_.fastest(), context_.scale)),
          fmt::format("compare scale.microstep{} with the drive; then reset the axis, "
                      "try slowly, and home it",
                      has_velocity_unit(*context_.descriptor)
                          ? ", the drive's own gear and drive: velocity_unit"
                          : "")));
  return true;
}

}  // namespace axisd
