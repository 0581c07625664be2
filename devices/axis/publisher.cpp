// What the axis shows: snapshots, and events where something changed.
#include "devices/axis/publisher.hpp"

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <cmath>

#include "devices/axis/execution.hpp"

namespace axisd {

namespace {

/// The notes of `now` that `before` does not have: one that comes and goes beside it makes no news of
/// another.
std::string new_notes(std::string_view before, std::string_view now) {
  constexpr std::string_view between = Drive::between_notes;
  const auto known = std::string(between).append(before).append(between);
  std::string news;
  for (std::size_t from = 0; from < now.size();) {
    const auto note = now.substr(from, now.find(between, from) - from);
    from += note.size() + between.size();
    if (known.contains(std::string(between).append(note).append(between))) continue;
    news += news.empty() ? "" : between;
    news += note;
  }
  return news;
}

}  // namespace

Publisher::Publisher(const AxisContext& context, const Shaft& shaft, const LinkMachine& link,
                     const std::optional<DriveIdentity>& identity, const PowerMachine& power,
                     const StopMachine& stop, const DriftWatch& drift, const Execution& execution)
    : context_(context),
      shaft_(shaft),
      link_(link),
      identity_(identity),
      power_(power),
      stop_(stop),
      drift_(drift),
      execution_(execution),
      eeprom_budget_(context.settings.limits.eeprom_saves_per_day, {}) {
  if (context_.env.persistence != nullptr) {
    const auto& axes = context_.env.persistence->current().axes;
    if (const auto found = axes.find(context_.settings.name); found != axes.end()) {
      eeprom_writes_ = found->second.eeprom_writes;
      eeprom_budget_ = {context_.settings.limits.eeprom_saves_per_day, found->second.eeprom};
    }
  }
  if (const auto before = context_.face->snapshot.load()) revision_ = before->revision;
}

/// M29: the edge lies between the previous sample and this one.
void Publisher::tell_edges(const DriveSample& before, const DriveSample& now) {
  if (!context_.env.event || (before.inputs == now.inputs && before.outputs == now.outputs)) return;
  const auto tell = [&](const std::vector<TerminalState>& was, const std::vector<TerminalState>& is) {
    for (std::size_t i = 0; i < is.size(); ++i)
      if (was[i].active != is[i].active)
        context_.env.event(context_.settings.name,
                           TerminalEdge{.terminal = is[i].name,
                                        .function = is[i].function,
                                        .active = is[i].active,
                                        .after = context_.env.clock->wall(before.asked_at),
                                        .before = context_.env.clock->wall(now.measured_at)});
  };
  tell(context_.terminals.inputs(before.inputs), context_.terminals.inputs(now.inputs));
  tell(context_.terminals.outputs(before.outputs), context_.terminals.outputs(now.outputs));
}

void Publisher::tell_changes(const AxisSnapshot& before, const AxisSnapshot& now) {
  if (!context_.env.event) return;
  if (before.link != now.link)
    context_.env.event(
        context_.settings.name,
        LinkChange{.to = now.link, .detail = now.link_error ? now.link_error->message : std::string()});
  // While it is being connected the notes follow from what it was found to be.
  const bool was_online = before.link == LinkState::online;
  if (auto news = new_notes(before.link_note, now.link_note); was_online && !news.empty())
    context_.env.event(context_.settings.name, LinkChange{.to = now.link, .detail = std::move(news)});
  if (before.state != now.state)
    context_.env.event(context_.settings.name,
                       StateChange{.from = before.state, .to = now.state, .cause = now.motion_cause});
  const bool other_fault = now.fault && (!before.fault || before.fault->reason != now.fault->reason ||
                                         before.fault->message != now.fault->message);
  if (other_fault) context_.env.event(context_.settings.name, AxisFault{.cause = *now.fault});
  if (before.drift != now.drift)
    context_.env.event(context_.settings.name, ConfigurationDrift{.text = now.drift});
}

MotionCause Publisher::motion_cause() const {
  if (shaft_.terminal_motion().moves()) return MotionCause::terminal;
  if (!shaft_.sample() || !shaft_.sample()->moving) return MotionCause::none;
  if (execution_.activity() && execution_.activity()->state != AxisState::standstill)
    return MotionCause::command;
  const bool by_terminal =
      shaft_.sample()->mode >= DriveMode::multi_position || context_.terminals.start_active(*shaft_.sample());
  return stop_.left_running() && !by_terminal ? MotionCause::command : MotionCause::unknown;
}

bool Publisher::note_eeprom_writes() {
  const auto written = context_.drive->take_eeprom_writes();
  if (written.saves == 0) return false;
  sampled_revision_ = 0;  // to be published
  eeprom_writes_ += written.registers;
  eeprom_budget_.count(written.saves, context_.env.clock->wall(context_.env.clock->now()));
  if (context_.env.persistence != nullptr)
    context_.env.persistence->count_eeprom_writes(context_.settings.name, written.registers,
                                                  eeprom_budget_.record(), {});
  if (written.registers > 0)
    context_.env.event(context_.settings.name,
                       EepromWritten{.registers = written.registers, .total = eeprom_writes_});
  return true;
}

Result<void> Publisher::permit_saves(std::uint64_t saves) {
  note_eeprom_writes();
  const auto now = context_.env.clock->wall(context_.env.clock->now());
  // Kept, so that hours of a clock that was set back are not found in the future again at each start.
  if (eeprom_budget_.settle(now) && context_.env.persistence != nullptr)
    context_.env.persistence->count_eeprom_writes(context_.settings.name, 0, eeprom_budget_.record(), {});
  auto permitted = eeprom_budget_.permit(saves, now);
  if (!permitted) permitted.error().where = {.bus = context_.settings.bus, .node = context_.settings.node};
  return permitted;
}

void Publisher::show_position(AxisSnapshot& shown) const {
  shown.position = shaft_.tracker().position();
  if (shaft_.sample() && shaft_.sample()->commanded_pulses) {
    const auto ahead =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(*shaft_.sample()->commanded_pulses) -
                                  static_cast<std::uint32_t>(shaft_.sample()->position_pulses));
    shown.commanded_position =
        context_.scale.to_units(shaft_.tracker().counter() + shaft_.tracker().offset() + ahead);
    shown.following_error = *shown.commanded_position - shown.position;
  }
  if (context_.settings.scale.modulo) {
    const auto into_turn = [turn = *context_.settings.scale.modulo](double position) {
      return position - std::floor(position / turn) * turn;
    };
    shown.position = into_turn(shown.position);
    if (shown.commanded_position) shown.commanded_position = into_turn(*shown.commanded_position);
  }
}

/// What the drive tells of itself.
void Publisher::show_sample(AxisSnapshot& shown) const {
  const auto bits = shaft_.sample().value_or(DriveSample{});
  shown.inputs = context_.terminals.inputs(bits.inputs);
  shown.outputs = context_.terminals.outputs(bits.outputs);
  if (!shaft_.sample()) return;
  shown.enabled = bits.enabled;
  // The sign of the speed register is not said; the direction register's is.
  const auto speed = std::abs(context_.scale.velocity_to_units(bits.velocity_rpm));
  shown.velocity = shaft_.watch().positive() || speed == 0 ? speed : -speed;
  shown.moving = bits.moving;
  shown.in_position = bits.in_position;
  shown.homed = bits.homed;
  shown.alarm_code = bits.alarm_code;
  const auto* alarm = bits.alarm_code == 0 ? nullptr : find_alarm(*context_.descriptor, bits.alarm_code);
  if (alarm != nullptr) shown.alarm_name = alarm->name;
  shown.sampled.set(bits.asked_at, bits.measured_at, context_.env.clock->wall(bits.measured_at));
}

void Publisher::publish() {
  note_eeprom_writes();
  auto next = boost::make_shared<AxisSnapshot>();
  next->name = context_.settings.name;
  next->bus = context_.settings.bus;
  next->node = context_.settings.node;
  next->model = context_.settings.model;
  next->own_descriptor = context_.settings.own_descriptor;
  next->unit = context_.settings.scale.unit;
  next->simulated = context_.simulated;
  next->state = execution_.state();
  next->link = link_.shown();
  next->link_error = link_.error();
  next->link_note = context_.drive->link_note();
  next->start_note = context_.drive->no_common_start();
  next->fault = execution_.fault();
  if (context_.env.holds != nullptr) next->holds = context_.env.holds->all();
  next->inhibited = context_.env.inhibited != nullptr && *context_.env.inhibited;
  next->enabled_by_us = power_.enabled_by_us();
  next->trust = shaft_.tracker().trust();
  next->position_source = context_.descriptor->capabilities.position_source;
  show_position(*next);
  next->identity = identity_;
  next->reboots = link_.restarts();
  next->drift = drift_.text();
  next->eeprom_writes = eeprom_writes_;
  next->motion_cause = motion_cause();
  if (const auto* lease = context_.env.leases->find(context_.settings.name))
    next->lease_holder = lease->holder();
  next->revision = ++revision_;
  next->positive_direction = shaft_.watch().positive();
  if (execution_.activity()) {
    next->command_id = execution_.activity()->command->value().id;
    if (execution_.activity()->plan.target) next->target = execution_.activity()->plan.target->position;
  }
  show_sample(*next);
  shown_ = next;
  const auto before = context_.face->snapshot.load();
  context_.face->snapshot.store(next);
  if (before) tell_changes(*before, *next);
  if (context_.env.published) context_.env.published();
}

bool Publisher::shows_sampled() {
  return revision_ == sampled_revision_ && !note_eeprom_writes() &&
         shown_->link_note == context_.drive->link_note() &&
         shown_->start_note == context_.drive->no_common_start();
}

void Publisher::show_again(const DriveSample& sample) {
  shown_->sampled.set(sample.asked_at, sample.measured_at, context_.env.clock->wall(sample.measured_at));
}

}  // namespace axisd
