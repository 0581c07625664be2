#include "tests/chaos/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace axisd::chaos {

using namespace std::chrono_literals;

namespace {

/// A drive that was switched off and on is found out within this, or it is offline (M7: every second, and a
/// line that loses replies may need several attempts).
constexpr auto reboot_unnoticed = 5s;

/// The drive's state is read within this, on the slowest line: what begins meanwhile does not show in it.
constexpr auto reading = 20ms;
/// A shaft that is measured follows the last pulse so late, at most (EncoderSettings::following, five times).
constexpr auto settling = 25ms;

bool is_motion(CommandKind kind) {
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative || kind == CommandKind::move_velocity ||
         kind == CommandKind::jog || kind == CommandKind::move_group;
}

bool is_stop(CommandKind kind) {
  return kind == CommandKind::halt || kind == CommandKind::stop || kind == CommandKind::quick_stop;
}

/// On CAN a stop stands in the control word until it is taken away: whose drive was read back holding it need
/// not get another.
bool holds_stop(const Station& station) {
  if (!station.on_can()) return false;
  return (station.drive->drive().peek(0x604000) & 0x100U) != 0;
}

}  // namespace

Judge::Judge(Plant& plant) : plant_(&plant) {
  for (const auto& station : plant.stations) subjects_[station.name];
  plant.on_bind = [this](Station& station, const Telegram& telegram) { on_bind(station, telegram); };
  plant.on_executed = [this](Station& station, const Executed& executed) { on_executed(station, executed); };
  plant.on_own_start = [this](Station& station) { on_own_start(station); };
  plant.on_refused = [this](const Station& station, const Telegram& telegram) {
    // Who refuses a stop has heard of it; that it rests is looked at all the same.
    if (telegram.stop) ++subjects_.at(station.name).stop_frames;
  };
  plant.on_hand = [this](const Station& station, const std::string& what) {
    note(station.name, what);
    if (what.starts_with("is turned")) subjects_.at(station.name).turned = plant_->world.now();
  };
}

Judge::~Judge() {
  plant_->on_bind = {};
  plant_->on_executed = {};
  plant_->on_own_start = {};
  plant_->on_refused = {};
  plant_->on_hand = {};
}

/// Where the load is, as the axis counts. Precondition: the origin is known.
double Judge::position(const Station& station, const Subject& subject) {
  return static_cast<double>(station.drive->shaft_pulses() - *subject.origin) / station.track.pulses_per_unit;
}

bool Judge::trusted(const Station& station) {
  return station.axis->snapshot()->trust != PositionTrust::unknown;
}

void Judge::note(const std::string& axis, std::string_view what) {
  constexpr std::size_t longest = 150;
  history_.push_back(fmt::format(
      "{:.4f} {} {}", std::chrono::duration<double>(plant_->world.now().time_since_epoch() - 1h).count(),
      axis, what));
  if (history_.size() > longest) history_.pop_front();
}

std::string Judge::history() const {
  std::string all;
  for (const auto& line : history_) all += line + "\n";
  return all;
}

void Judge::violation(const std::string& axis, std::string_view what) {
  note(axis, fmt::format("VIOLATION: {}", what));
  if (violations_.empty()) violations_.push_back(history());
  violations_.push_back(fmt::format("{}: {}", axis, what));
}

void Judge::stop_asked(const std::string& axis) {
  auto& subject = subjects_.at(axis);
  note(axis, "stop asked for");
  subject.stop_owed = true;
  subject.stop_frames_at_ask = subject.stop_frames;
}

void Judge::accepted(const CommandPtr& command) {
  if (judged_.contains(command.get())) return;  // a repeat, or a renewal
  const auto& value = command->value();
  auto& subject = subjects_.at(value.axis);
  auto judged = std::make_shared<Judged>(Judged{.command = command,
                                                .last = value.state,
                                                .stop_frames = subject.stop_frames,
                                                .accepted_at = plant_->world.now()});
  note(value.axis, fmt::format("{} {} accepted{}", to_string(value.kind), value.id,
                               value.asked.distance   ? fmt::format(", by {:.3f}", *value.asked.distance)
                               : value.asked.position ? fmt::format(", to {:.3f}", *value.asked.position)
                                                      : std::string{}));
  judged_[command.get()] = judged;
  ++tally_.commands;
  if (is_motion(value.kind)) subject.motions.push_back(judged);
  command->observe(judged, [this, weak = std::weak_ptr(judged)](const Command& now) {
    if (const auto known = weak.lock()) on_change(known, now);
  });
}

void Judge::on_bind(Station& station, const Telegram& telegram) {
  auto& subject = subjects_.at(station.name);
  if (telegram.stop) {
    note(station.name, "a stop on the wire");
    subject.stop_owed = false;
  }
  if (telegram.start != Telegram::Start::none)
    on_trigger(station, subject, telegram.start == Telegram::Start::homing);
  if (telegram.waiting == Telegram::Waiting::start) {
    note(station.name, "a start that waits for a SYNC on the wire");
    check_stops(station, subject);
    subject.armed = Armed::told;
  } else if (telegram.waiting == Telegram::Waiting::nothing) {
    const bool too_late = subject.armed == Armed::released || subject.armed == Armed::withdrawn;
    subject.armed = too_late ? Armed::withdrawn : Armed::no;
  }
  if (telegram.sync && subject.armed != Armed::no) on_sync(station, subject);
  if (telegram.energise) check_enable(station);
}

void Judge::check_enable(Station& station) {
  const bool asked = std::ranges::any_of(judged_, [&](const auto& one) {
    const auto& command = one.second->command->value();
    return command.axis == station.name && command.kind == CommandKind::enable && !ended(command.state);
  });
  if (!asked) violation(station.name, "the power stage is switched on, and nobody asked for it");
}

/// Whose start the next trigger has to be: what is buffered waits for the command before it.
Judge::JudgedPtr Judge::due(Subject& subject) {
  auto& motions = subject.motions;
  while (motions.size() > 1 && ended(motions.front()->command->value().state)) motions.pop_front();
  return motions.empty() ? nullptr : motions.front();
}

void Judge::check_stops(Station& station, const Subject& subject) {
  if (subject.stop_owed) violation(station.name, "a start is sent between a stop's request and its frame");
  if (inhibited_) violation(station.name, "a start is sent while StopAll holds");
}

/// A drive that lost its SYNC starts with the next one.
void Judge::on_sync(Station& station, Subject& subject) {
  if (subject.armed == Armed::withdrawn) {
    subject.armed = Armed::no;
    return;
  }
  if (subject.armed == Armed::released) return check_stops(station, subject);
  subject.armed = Armed::released;
  on_trigger(station, subject, false);
}

void Judge::on_trigger(Station& station, Subject& subject, bool homing) {
  ++tally_.starts;
  note(station.name, homing ? "a start of homing on the wire" : "a start on the wire");
  check_stops(station, subject);
  const auto motion = due(subject);
  if (!motion) return violation(station.name, "a start is sent without a command");
  subject.triggered = motion;
  const auto& command = motion->command->value();
  if (ended(command.state))
    violation(station.name, fmt::format("a start is sent after {} {}", command.id, to_string(command.state)));
  const bool home = command.kind == CommandKind::home;
  if (++(homing ? motion->homings : motion->moves) > 1)
    violation(station.name, fmt::format("a second start is sent for {}", command.id));
  if (homing && !home) violation(station.name, "homing is started for a command that is none");
}

void Judge::on_executed(Station& station, const Executed& executed) {
  auto& subject = subjects_.at(station.name);
  const auto& telegram = executed.telegram;
  if (telegram.stop) ++subject.stop_frames;
  const bool by_sync = telegram.sync && subject.armed != Armed::no;
  if (by_sync && subject.armed != Armed::told) subject.armed = Armed::no;
  // What the wire doubles starts once more what is being started, to the same end.
  const bool doubled =
      subject.last_executed == executed.when && std::ranges::equal(subject.last_frame, executed.frame);
  subject.last_executed = executed.when;
  subject.last_frame.assign(executed.frame.begin(), executed.frame.end());
  if (executed.starts == 0 || doubled) return;
  note(station.name, fmt::format("the drive starts at {}{}", executed.from,
                                 telegram.way ? fmt::format(", by {}", *telegram.way) : ""));
  if (telegram.start == Telegram::Start::none && !by_sync)
    return violation(station.name, "the drive starts by something else than a start");
  if (!subject.triggered) return violation(station.name, "the drive starts without a command");
  tally_.by_sync += by_sync ? 1 : 0;
  subject.triggered->starts += executed.starts;
  const auto& command = subject.triggered->command->value();
  const int most = command.kind == CommandKind::home ? 2 : 1;
  if (subject.triggered->starts > most)
    violation(station.name, fmt::format("{} starts {} times", command.id, subject.triggered->starts));
  on_departure(station, subject, executed);
}

void Judge::on_departure(Station& station, const Subject& subject, const Executed& executed) {
  ++tally_.departures;
  // Only by a terminal a shaft that rested when it was read is turned, or let go of.
  const auto now = plant_->world.now();
  const bool turned = station.terminal_may_start(now) || now <= station.released_until + Witness::start_time;
  const auto lately = turned ? executed.lately : Stretch{.low = executed.from, .high = executed.from};
  subject.triggered->departed = lately;
  const auto& command = subject.triggered->command->value();
  const auto wrong = wrong_departure(command, station.track,
                                     {.from = executed.from,
                                      .lately = lately,
                                      .way = executed.telegram.way,
                                      .moving = executed.moving,
                                      .trusted = trusted(station),
                                      .origin = subject.origin});
  if (!wrong.empty()) violation(station.name, wrong);
}

void Judge::on_own_start(Station& station) {
  note(station.name, "the drive starts by itself");
  ++tally_.by_terminal;
  auto& subject = subjects_.at(station.name);
  subject.own_start = plant_->world.now();
  subject.own_start_from = station.drive->lately();
  if (!station.terminal_may_start(plant_->world.now()))
    violation(station.name, "the drive starts, and nobody touched it");
}

void Judge::on_change(const JudgedPtr& judged, const Command& command) {
  note(command.axis, fmt::format("{} {} {}{}", to_string(command.kind), command.id, to_string(command.state),
                                 command.cause ? ": " + command.cause->message : ""));
  if (command.state < judged->last || judged->ends > 0)
    violation(command.axis, fmt::format("{} goes from {} to {}", command.id, to_string(judged->last),
                                        to_string(command.state)));
  judged->last = command.state;
  if (!ended(command.state)) return;
  ++judged->ends;
  auto* station = plant_->find(command.axis);
  on_end(*station, subjects_.at(command.axis), *judged, command);
}

void Judge::on_end(Station& station, Subject& subject, const Judged& judged, const Command& command) {
  const bool not_executed = command.cause && command.cause->outcome == Outcome::not_executed;
  if (not_executed && judged.starts > 0)
    violation(station.name, fmt::format("{} was not executed, it says, and the drive started", command.id));
  tally_.not_executed += not_executed ? 1 : 0;
  if (command.state != CommandState::done && !command.cause)
    violation(station.name, fmt::format("{} is {} without a cause", command.id, to_string(command.state)));
  ++(command.state == CommandState::done      ? tally_.done
     : command.state == CommandState::aborted ? tally_.aborted
     : command.state == CommandState::error   ? tally_.failed
                                              : tally_.unknown);
  if (command.state == CommandState::done) on_done(station, subject, judged, command);
}

void Judge::check_arrival(Station& station, const Subject& subject, const Judged& judged,
                          const Command& command) {
  // What begins after the reading that ended it was asked for does not show in it.
  const auto asked = station.axis->snapshot()->sampled.after();
  if (asked - subject.own_start <= reading || asked - station.released_until <= reading) return;
  if (command.asked.distance) {
    if (subject.turned >= judged.accepted_at) return;
    ++tally_.distances;
    const auto there = station.drive->shaft_pulses();
    // A terminal may have started what was loaded, before the trigger came.
    const auto unstarted =
        subject.own_start >= judged.accepted_at ? subject.own_start_from : Stretch{there, there};
    if (const auto wrong = wrong_arrival(command, station.track, judged.departed.value_or(unstarted), there);
        !wrong.empty())
      violation(station.name, wrong);
    return;
  }
  const auto slack = std::abs(static_cast<double>(station.track.slack) / station.track.pulses_per_unit);
  if (command.asked.position && is_motion(command.kind) && subject.origin && trusted(station) &&
      std::abs(position(station, subject) - *command.granted.position) > slack)
    violation(station.name, fmt::format("{} is done at {:.3f}, and the load is at {:.3f}", command.id,
                                        *command.granted.position, position(station, subject)));
}

void Judge::on_done(Station& station, Subject& subject, const Judged& judged, const Command& command) {
  const bool positioned = command.asked.position.has_value() || command.asked.distance.has_value();
  const bool moves = station.drive->shaft_moving() && !station.terminal_may_start(plant_->world.now());
  if (is_stop(command.kind)) {
    ++tally_.stops;
    if (subject.stop_frames <= judged.stop_frames && !holds_stop(station))
      violation(station.name, fmt::format("{} is done, and the drive never got it", command.id));
    const bool another = std::ranges::any_of(
        subject.motions, [](const auto& motion) { return !ended(motion->command->value().state); });
    if (moves && !another) violation(station.name, fmt::format("{} is done, and the load moves", command.id));
  }
  if (is_motion(command.kind) && (positioned || command.kind == CommandKind::home) && moves)
    violation(station.name, fmt::format("{} is done, and the load moves", command.id));
  check_arrival(station, subject, judged, command);
  if (command.kind == CommandKind::home && judged.homings != 1)
    violation(station.name, fmt::format("{} is done without homing", command.id));
  if (command.kind != CommandKind::home && command.kind != CommandKind::set_position) return;
  subject.origin = station.drive->shaft_pulses();
  if (command.kind == CommandKind::home) return;
  *subject.origin -= std::llround(*command.asked.position * station.track.pulses_per_unit);
  // Turned meanwhile: nobody can say which place was meant.
  if (station.drive->last_moved() >= judged.accepted_at) subject.origin.reset();
}

void Judge::look() {
  for (auto& station : plant_->stations) {
    const auto state = station.axis->snapshot();
    const auto& subject = subjects_.at(station.name);
    const auto settled = station.drive->last_moved() + (station.closed_loop() ? settling : Duration{});
    const bool fresh = state->link == LinkState::online && state->sampled.after() > settled;
    const bool rebooted = plant_->world.now() - station.drive->last_power_loss() < reboot_unnoticed;
    if (!trusted(station) || !subject.origin || !fresh || rebooted) continue;
    ++tally_.positions;
    const auto slack = std::abs(static_cast<double>(station.track.slack) / station.track.pulses_per_unit);
    if (std::abs(state->position - position(station, subject)) > slack)
      violation(station.name, fmt::format("shows {:.3f}, and the load is at {:.3f}", state->position,
                                          position(station, subject)));
  }
}

void Judge::check_marks(const Station& station, int offset, const std::vector<std::uint16_t>& read) {
  for (std::size_t i = 0; i < read.size(); ++i) {
    ++tally_.marks;
    if (const auto expected = mark(station.node, offset + static_cast<int>(i)); read[i] != expected)
      return violation(station.name,
                       fmt::format("a register is read as 0x{:04X}, and holds 0x{:04X}", read[i], expected));
  }
}

void Judge::conclude() {
  for (const auto& [record, judged] : judged_) {
    const auto& command = judged->command->value();
    if (!ended(command.state) || judged->ends > 1)
      violation(command.axis,
                fmt::format("{} {} has ended {} times", to_string(command.kind), command.id, judged->ends));
  }
  for (auto& station : plant_->stations) {
    const auto& subject = subjects_.at(station.name);
    if (subject.stop_owed || (subject.stop_frames == subject.stop_frames_at_ask && !holds_stop(station)))
      violation(station.name, "a stop never arrived");
    if (station.drive->shaft_moving()) violation(station.name, "the load moves after StopAll");
  }
}

}  // namespace axisd::chaos
