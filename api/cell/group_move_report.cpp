// How a move of several machines stands.
#include <algorithm>

#include "api/cell/group_move_machine.hpp"
#include "api/cell/roster.hpp"
#include "api/cell/status.hpp"

namespace axisd::cell {
namespace {

/// It may move, or may have moved, and nobody says how that ended.
bool is_left_open(const axisd::v1::GroupMove& move) { return !has_ended(move.state()) && was_told(move); }

}  // namespace

/// While one has not ended, the move has not, either.
axisd::v1::CommandState GroupMoveMachine::result() const {
  const auto any_is = [this](axisd::v1::CommandState state) {
    return std::ranges::any_of(parts_, [state](const Part& part) { return part.move.state() == state; });
  };
  if (state_ != State::over)
    return any_is(axisd::v1::COMMAND_STATE_ACCEPTED) || any_is(axisd::v1::COMMAND_STATE_UNSPECIFIED)
               ? axisd::v1::COMMAND_STATE_ACCEPTED
               : axisd::v1::COMMAND_STATE_ACTIVE;
  if (any_is(axisd::v1::COMMAND_STATE_UNKNOWN) || any(Part::Stage::told) ||
      (may_have_started_ && any(Part::Stage::lost)) || std::ranges::any_of(parts_, is_left_open, &Part::move))
    return axisd::v1::COMMAND_STATE_UNKNOWN;
  for (const auto worst : {axisd::v1::COMMAND_STATE_ERROR, axisd::v1::COMMAND_STATE_ABORTED})
    if (any_is(worst)) return worst;
  return cause_ || any_is(axisd::v1::COMMAND_STATE_ACCEPTED) ? axisd::v1::COMMAND_STATE_ABORTED
                                                             : axisd::v1::COMMAND_STATE_DONE;
}

std::vector<std::string> GroupMoveMachine::commands_at(std::size_t machine) const {
  std::vector<std::string> ids;
  for (const auto& member : parts_[machine].move.members())
    if (!has_ended(member.command().state())) ids.push_back(member.command().id());
  return ids;
}

v1::CellGroupMove GroupMoveMachine::make_value() const {
  v1::CellGroupMove to;
  to.set_state(result());
  if (cause_) *to.mutable_cause() = *cause_;
  for (const auto& part : parts_) {
    auto& machine = *to.add_machines();
    machine.set_machine(part.machine);
    *machine.mutable_move() = part.move;
    if (part.error) *machine.mutable_error() = *part.error;
    if (!to.has_cause() && part.move.has_cause())
      *to.mutable_cause() = named(part.move.cause(), part.machine);
  }
  const auto lost = std::ranges::find(parts_, Part::Stage::lost, &Part::stage);
  if (!to.has_cause() && state_ == State::over && lost != parts_.end())
    *to.mutable_cause() = named(*lost->error, lost->machine);
  fill_skew(to);
  return to;
}

/// By this computer's clock, as far as it is known how far the others' are from it.
void GroupMoveMachine::fill_skew(v1::CellGroupMove& to) const {
  std::optional<TimePoint> first, last;
  Duration largest_error{}, second_error{};
  bool all_started = true;
  std::vector<std::optional<TimePoint>> starts(parts_.size());
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto& move = parts_[i].move;
    const auto& preparation = move.preparation();
    if (!preparation.has_first_start()) {
      // Its members stood at their targets.
      all_started = all_started && move.state() == axisd::v1::COMMAND_STATE_DONE;
      continue;
    }
    const TimePoint by_its_clock(duration_of(preparation.first_start()));
    const auto near = parts_[i].clock.at(by_its_clock);
    if (!near) return;  // another entrance knows
    const auto clock = *parts_[i].clock.at(by_its_clock - near->offset);
    starts[i] = by_its_clock - clock.offset;
    all_started = all_started && move.has_start_skew();
    first = first ? std::min(*first, *starts[i]) : *starts[i];
    const auto latest = *starts[i] + duration_of(move.start_skew());
    last = last ? std::max(*last, latest) : latest;
    auto& machine = *to.mutable_machines(static_cast<int>(i));
    set_duration(*machine.mutable_clock_offset(), clock.offset);
    set_duration(*machine.mutable_clock_error(), clock.error);
    second_error = std::max(second_error, std::min(largest_error, clock.error));
    largest_error = std::max(largest_error, clock.error);
  }
  if (!first) return;
  for (std::size_t i = 0; i < parts_.size(); ++i)
    if (starts[i])
      set_duration(*to.mutable_machines(static_cast<int>(i))->mutable_started_after(), *starts[i] - *first);
  if (!all_started) return;
  set_duration(*to.mutable_start_skew(), *last - *first);
  set_duration(*to.mutable_start_skew_error(), largest_error + second_error);
}

}  // namespace axisd::cell
