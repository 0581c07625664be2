#include "tests/chaos/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace axisd::chaos {

using namespace std::chrono_literals;

namespace {

constexpr std::uint16_t trigger_register = 0x0027, stop_register = 0x0028, enable_register = 0x0029,
                        homing_register = 0x0030;
constexpr double one_pulse = 1 / pulses_per_mm;
/// A drive that was switched off and on is found out within this, or it is offline (M7: every second, and a
/// line that loses replies may need several attempts).
constexpr auto reboot_unnoticed = 5s;

bool is_motion(CommandKind kind) {
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative || kind == CommandKind::move_velocity || kind == CommandKind::jog;
}

bool is_stop(CommandKind kind) {
  return kind == CommandKind::halt || kind == CommandKind::stop || kind == CommandKind::quick_stop;
}

}  // namespace

Judge::Judge(Plant& plant) : plant_(&plant) {
  for (const auto& station : plant.stations) subjects_[station.name];
  plant.on_bind = [this](Station& station, const test::WireEntry& entry) { on_bind(station, entry); };
  plant.on_executed = [this](Station& station, const Executed& executed) { on_executed(station, executed); };
}

Judge::~Judge() {
  plant_->on_bind = {};
  plant_->on_executed = {};
}

double Judge::load(const Station& station) {
  const auto mm = static_cast<double>(station.drive->shaft_pulses()) / pulses_per_mm;
  return station.axis->settings().scale.invert ? -mm : mm;
}

void Judge::note(const std::string& axis, std::string_view what) {
  constexpr std::size_t longest = 60;
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
  subject.stop_asked = plant_->world.now();
  subject.stop_frames_at_ask = subject.stop_frames;
}

void Judge::accepted(const CommandPtr& command) {
  if (judged_.contains(command.get())) return;  // a repeat, or a renewal
  const auto& value = command->value();
  auto& subject = subjects_.at(value.axis);
  auto judged = std::make_shared<Judged>(
      Judged{.command = command, .last = value.state, .stop_frames = subject.stop_frames});
  note(value.axis, fmt::format("{} {} accepted", to_string(value.kind), value.id));
  judged_[command.get()] = judged;
  ++tally_.commands;
  if (is_motion(value.kind)) subject.motion = judged;
  command->observe(judged, [this, weak = std::weak_ptr(judged)](const Command& now) {
    if (const auto known = weak.lock()) on_change(known, now);
  });
}

void Judge::on_bind(Station& station, const test::WireEntry& entry) {
  auto& subject = subjects_.at(station.name);
  if (!entry.is_write()) return;
  const auto address = entry.address();
  note(station.name, fmt::format("write 0x{:04X} on the wire", address));
  if (address == stop_register) subject.stop_owed = false;
  if (address == trigger_register || address == homing_register)
    on_trigger(station, subject, address == homing_register);
  if (address == enable_register && entry.value() == 1) {
    const bool asked = std::ranges::any_of(judged_, [&](const auto& one) {
      const auto& command = one.second->command->value();
      return command.axis == station.name && command.kind == CommandKind::enable && !ended(command.state);
    });
    if (!asked) violation(station.name, "the power stage is switched on, and nobody asked for it");
  }
}

void Judge::on_trigger(Station& station, Subject& subject, bool homing) {
  ++tally_.starts;
  if (subject.stop_owed) violation(station.name, "a start is sent between a stop's request and its frame");
  if (inhibited_) violation(station.name, "a start is sent while StopAll holds");
  if (!subject.motion) return violation(station.name, "a start is sent without a command");
  auto& motion = *subject.motion;
  subject.triggered = subject.motion;
  const auto& command = motion.command->value();
  if (ended(command.state))
    violation(station.name, fmt::format("a start is sent after {} {}", command.id, to_string(command.state)));
  const bool home = command.kind == CommandKind::home;
  if (++(homing ? motion.homings : motion.moves) > 1)
    violation(station.name, fmt::format("a second start is sent for {}", command.id));
  if (homing && !home) violation(station.name, "homing is started for a command that is none");
}

void Judge::on_executed(Station& station, const Executed& executed) {
  auto& subject = subjects_.at(station.name);
  if (executed.writes(stop_register)) ++subject.stop_frames;
  // What the wire doubles starts once more what is being started, to the same end.
  const bool doubled =
      subject.last_executed == executed.when && std::ranges::equal(subject.last_frame, executed.frame);
  subject.last_executed = executed.when;
  subject.last_frame.assign(executed.frame.begin(), executed.frame.end());
  if (executed.starts == 0 || doubled) return;
  note(station.name, "the drive starts");
  if (!executed.writes(trigger_register) && !executed.writes(homing_register))
    return violation(station.name, "the drive starts by something else than a start");
  if (!subject.triggered) return violation(station.name, "the drive starts without a command");
  subject.triggered->starts += executed.starts;
  const int most = subject.triggered->command->value().kind == CommandKind::home ? 2 : 1;
  if (subject.triggered->starts > most)
    violation(station.name, fmt::format("{} starts {} times", subject.triggered->command->value().id,
                                        subject.triggered->starts));
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
  ++(command.state == CommandState::done      ? tally_.done
     : command.state == CommandState::aborted ? tally_.aborted
     : command.state == CommandState::error   ? tally_.failed
                                              : tally_.unknown);
  if (command.state == CommandState::done) on_done(station, subject, judged, command);
}

void Judge::on_done(Station& station, Subject& subject, const Judged& judged, const Command& command) {
  const auto at = load(station);
  const bool positioned =
      command.kind == CommandKind::move_absolute || command.kind == CommandKind::move_relative;
  if (is_stop(command.kind)) {
    ++tally_.stops;
    if (subject.stop_frames <= judged.stop_frames)
      violation(station.name, fmt::format("{} is done, and the drive never got it", command.id));
    if (station.drive->shaft_moving() && !(subject.motion && !ended(subject.motion->command->value().state)))
      violation(station.name, fmt::format("{} is done, and the load moves", command.id));
  }
  if (positioned || command.kind == CommandKind::home)
    if (station.drive->shaft_moving())
      violation(station.name, fmt::format("{} is done, and the load moves", command.id));
  if (positioned && subject.origin && station.axis->snapshot()->trust != PositionTrust::unknown &&
      std::abs(at - *subject.origin - *command.granted.position) > one_pulse)
    violation(station.name, fmt::format("{} is done at {:.3f}, and the load is at {:.3f}", command.id,
                                        *command.granted.position, at - *subject.origin));
  if (command.kind == CommandKind::home && judged.homings != 1)
    violation(station.name, fmt::format("{} is done without homing", command.id));
  if (command.kind == CommandKind::home) subject.origin = at;
  if (command.kind == CommandKind::set_position) subject.origin = at - *command.asked.position;
}

void Judge::look() {
  for (auto& station : plant_->stations) {
    const auto state = station.axis->snapshot();
    const auto& subject = subjects_.at(station.name);
    const bool fresh =
        state->link == LinkState::online && state->sampled.after() > station.drive->last_moved();
    const bool rebooted = plant_->world.now() - station.drive->last_power_loss() < reboot_unnoticed;
    if (state->trust == PositionTrust::unknown || !subject.origin || !fresh || rebooted) continue;
    ++tally_.positions;
    if (std::abs(state->position - (load(station) - *subject.origin)) > one_pulse)
      violation(station.name, fmt::format("shows {:.3f}, and the load is at {:.3f}", state->position,
                                          load(station) - *subject.origin));
  }
}

void Judge::check_marks(const Station& station, int offset, const std::vector<std::uint16_t>& read) {
  for (std::size_t i = 0; i < read.size(); ++i) {
    ++tally_.marks;
    if (const auto expected = Plant::mark(station.node, offset + static_cast<int>(i)); read[i] != expected)
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
    if (subject.stop_owed || subject.stop_frames == subject.stop_frames_at_ask)
      violation(station.name, "a stop never arrived");
    if (station.drive->shaft_moving()) violation(station.name, "the load moves after StopAll");
  }
}

}  // namespace axisd::chaos
