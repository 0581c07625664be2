#include "api/cell/group_move_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/cell/roster.hpp"
#include "api/cell/status.hpp"

namespace axisd::cell {
namespace {

bool has_ended(axisd::v1::CommandState state) {
  return state == axisd::v1::COMMAND_STATE_DONE || state == axisd::v1::COMMAND_STATE_ABORTED ||
         state == axisd::v1::COMMAND_STATE_ERROR || state == axisd::v1::COMMAND_STATE_UNKNOWN;
}

Duration of(const google::protobuf::Duration& from) {
  return std::chrono::seconds(from.seconds()) + Duration(from.nanos());
}

/// Errors keep their address: the machine's name stands before that of the axis.
axisd::v1::ErrorDetail named(axisd::v1::ErrorDetail detail, const std::string& machine) {
  detail.set_message(fmt::format("{}: {}", machine, detail.message()));
  return detail;
}

axisd::v1::ErrorDetail told_too_late() {
  return detail_of(axisd::v1::REASON_EXPIRED, "it took too long until all machines were told to start",
                   "repeat the move with another request_id; look at the network if it is often so");
}

/// It may move, or may have moved, and nobody says how that ended.
bool is_left_open(const axisd::v1::GroupMove& move) {
  return !has_ended(move.state()) &&
         (move.state() == axisd::v1::COMMAND_STATE_ACTIVE || move.preparation().has_starts_at());
}

std::string milliseconds(Duration time) {
  return fmt::format("{:.3f} ms", std::chrono::duration<double, std::milli>(time).count());
}

}  // namespace

GroupMoveMachine::GroupMoveMachine(std::vector<std::string> machines, Duration clock_tolerance)
    : clock_tolerance_(clock_tolerance) {
  for (auto& name : machines) parts_.push_back({.machine = std::move(name)});
}

bool GroupMoveMachine::all(Part::Stage stage) const {
  return std::ranges::all_of(parts_, [stage](const Part& part) { return part.stage == stage; });
}

bool GroupMoveMachine::any(Part::Stage stage) const {
  return std::ranges::any_of(parts_, [stage](const Part& part) { return part.stage == stage; });
}

GroupMoveMachine::Errands GroupMoveMachine::begin() {
  Errands errands;
  for (std::size_t i = 0; i < parts_.size(); ++i)
    errands.push_back({.kind = Errand::Kind::prepare, .machine = i});
  return errands;
}

void GroupMoveMachine::take(Part& part, const axisd::v1::GroupMove& move) {
  part.move = move;
  if (has_ended(move.state())) part.stage = Part::Stage::ended;
}

GroupMoveMachine::Errands GroupMoveMachine::prepared(std::size_t machine, const Answer& answer) {
  auto& part = parts_[machine];
  Errands errands;
  if (!answer.status.ok()) {
    part.stage = Part::Stage::ended;
    part.error = detail_of(answer.status);
    if (state_ == State::preparing) return fail(machine, answer.status, answer.received);
    end_if_over();
    return errands;
  }
  const auto& preparation = answer.move.preparation();
  const bool told = preparation.has_starts_at() || answer.move.state() == axisd::v1::COMMAND_STATE_ACTIVE;
  part.stage = told ? Part::Stage::foreign : Part::Stage::prepared;
  take(part, answer.move);
  if (state_ == State::giving_up) {
    stop_part(machine, errands);
    end_if_over();
  } else if (state_ == State::preparing && !any(Part::Stage::asked)) {
    return judge_prepared(answer.received);
  }
  return errands;
}

/// All have answered, and none refuses. A request that is repeated finds what became of it before.
GroupMoveMachine::Errands GroupMoveMachine::judge_prepared(TimePoint now) {
  Errands errands;
  if (any(Part::Stage::foreign)) {
    attach();
  } else if (all(Part::Stage::ended)) {
    state_ = State::over;
  } else if (any(Part::Stage::ended)) {
    const auto ended = std::ranges::find(parts_, Part::Stage::ended, &Part::stage);
    auto cause = ended->move.has_cause()
                     ? ended->move.cause()
                     : detail_of(axisd::v1::REASON_REQUEST_ID_CONFLICT, "this request was done there before",
                                 "use another request_id");
    return give_up(named(std::move(cause), ended->machine), grpc::StatusCode::FAILED_PRECONDITION, now);
  } else {
    state_ = State::measuring;
    for (std::size_t i = 0; i < parts_.size(); ++i)
      errands.push_back({.kind = Errand::Kind::measure, .machine = i});
  }
  return errands;
}

bool GroupMoveMachine::goes_on(std::size_t machine, const Answer& answer, Errands& errands) {
  auto& part = parts_[machine];
  if (!answer.status.ok()) {
    part.error = detail_of(answer.status);
    errands = fail(machine, answer.status, answer.received);
    return false;
  }
  take(part, answer.move);
  if (part.stage != Part::Stage::ended || part.move.state() == axisd::v1::COMMAND_STATE_DONE) return true;
  errands = give_up(named(part.move.cause(), part.machine), grpc::StatusCode::ABORTED, answer.received);
  return false;
}

GroupMoveMachine::Errands GroupMoveMachine::measured(std::size_t machine, const Answer& answer) {
  Errands errands;
  if (state_ != State::measuring || !goes_on(machine, answer, errands)) return errands;
  auto& clock = parts_[machine].clock;
  clock.add(answer.sent, answer.received, answer.clock);
  if (clock.count() < round_trips) {
    errands.push_back({.kind = Errand::Kind::measure, .machine = machine});
    return errands;
  }
  const auto error = clock.at(answer.received)->error;
  if (error > clock_tolerance_)
    return give_up(
        detail_of(axisd::v1::REASON_OUT_OF_RANGE,
                  fmt::format("{}: its clock is known to {} only, {} are allowed (clock_tolerance)",
                              parts_[machine].machine, milliseconds(error), milliseconds(clock_tolerance_)),
                  "allow more, or look at the network between the machines and at their load"),
        grpc::StatusCode::OUT_OF_RANGE, answer.received);
  const bool all_known =
      std::ranges::all_of(parts_, [](const Part& part) { return part.clock.count() >= round_trips; });
  return all_known ? choose_moment(answer.received) : errands;
}

/// As soon as all can be told, and every one has had its last look at its members.
GroupMoveMachine::Errands GroupMoveMachine::choose_moment(TimePoint now) {
  Duration notice{};
  for (const auto& part : parts_) notice = std::max(notice, of(part.move.preparation().notice()));
  const auto moment = now + notice + lead;
  Errands errands;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto at = (moment + parts_[i].clock.at(now)->offset).time_since_epoch();
    if (at > of(parts_[i].move.preparation().expires()))
      return give_up(
          detail_of(axisd::v1::REASON_EXPIRED,
                    fmt::format("{}: it took too long until all machines were prepared", parts_[i].machine),
                    "repeat the move with another request_id; if it is often so, name fewer axes, or look "
                    "at the machine that takes longest"),
          grpc::StatusCode::DEADLINE_EXCEEDED, now);
    errands.push_back({.kind = Errand::Kind::tell, .machine = i, .at = at});
  }
  latest_told_ = now + lead / 2;  // the rest is for the word that all were
  state_ = State::telling;
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::told(std::size_t machine, const Answer& answer) {
  Errands errands;
  auto& part = parts_[machine];
  if (state_ == State::giving_up && part.stage == Part::Stage::prepared && answer.status.ok()) {
    take(part, answer.move);  // it was stopped already
    end_if_over();
  }
  if (state_ != State::telling) return errands;
  if (!answer.status.ok() && detail_of(answer.status).reason() == axisd::v1::REASON_REQUEST_ID_CONFLICT) {
    part.stage = Part::Stage::foreign;
    attach();
    return errands;
  }
  if (!goes_on(machine, answer, errands)) return errands;
  if (part.stage == Part::Stage::prepared) part.stage = Part::Stage::told;
  part.next = answer.received + renewal_period;
  if (any(Part::Stage::prepared)) return errands;
  if (answer.received > latest_told_)
    return give_up(told_too_late(), grpc::StatusCode::ABORTED, answer.received);
  state_ = State::running;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].stage != Part::Stage::told) continue;
    errands.push_back({.kind = Errand::Kind::renew, .machine = i, .all_told = true});
    parts_[i].next = answer.received + renewal_period;
  }
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::renewed(std::size_t machine, const Answer& answer) {
  Errands errands;
  auto& part = parts_[machine];
  if (part.stage == Part::Stage::ended) return errands;  // another answer was faster
  if (state_ == State::giving_up && answer.status.ok()) {
    take(part, answer.move);
    end_if_over();
  }
  if (state_ != State::running && state_ != State::telling) return errands;
  if (!goes_on(machine, answer, errands)) return errands;
  part.clock.add(answer.sent, answer.received, answer.clock);
  if (state_ == State::running && all(Part::Stage::ended)) state_ = State::over;
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::cancelled(std::size_t machine, const grpc::Status& status) {
  Errands errands;
  auto& part = parts_[machine];
  if (status.ok()) return errands;
  part.stopping = false;  // once more; it stops by itself, too, as nobody renews it
  if (!part.error) part.error = detail_of(status);
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::looked(std::size_t machine, const Answer& answer) {
  auto& part = parts_[machine];
  if (answer.status.ok()) {
    take(part, answer.move);
  } else if (state_ == State::attached ||
             detail_of(answer.status).reason() == axisd::v1::REASON_UNKNOWN_COMMAND) {
    // Its axisd was started anew, which starts nothing; or nobody can be asked.
    part.error = detail_of(answer.status);
    part.stage = Part::Stage::ended;
  }
  end_if_over();
  return {};
}

GroupMoveMachine::Errands GroupMoveMachine::tick(TimePoint now) {
  Errands errands;
  if (state_ == State::telling && now > latest_told_)
    return give_up(told_too_late(), grpc::StatusCode::ABORTED, now);
  const bool renews = state_ == State::telling || state_ == State::running;
  const bool looks = state_ == State::giving_up || state_ == State::attached;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    auto& part = parts_[i];
    if (part.stage == Part::Stage::asked || part.stage == Part::Stage::ended || now < part.next) continue;
    if (renews && part.stage == Part::Stage::told) {
      part.next = now + renewal_period;
      errands.push_back({.kind = Errand::Kind::renew, .machine = i, .all_told = state_ == State::running});
    } else if (looks) {
      part.next = now + look_period;
      if (state_ == State::giving_up) stop_part(i, errands);
      errands.push_back({.kind = Errand::Kind::look, .machine = i});
    }
  }
  if (state_ == State::giving_up && now >= end_by_) state_ = State::over;
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::fail(std::size_t machine, const grpc::Status& status,
                                                 TimePoint now) {
  return give_up(named(detail_of(status), parts_[machine].machine), status.error_code(), now);
}

GroupMoveMachine::Errands GroupMoveMachine::give_up(axisd::v1::ErrorDetail cause, grpc::StatusCode code,
                                                    TimePoint now) {
  if (state_ == State::preparing || state_ == State::measuring) refusal_ = to_status(code, cause);
  cause_ = std::move(cause);
  state_ = State::giving_up;
  end_by_ = now + longest_end;
  Errands errands;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    parts_[i].next = now;
    stop_part(i, errands);
  }
  end_if_over();
  return errands;
}

void GroupMoveMachine::stop_part(std::size_t machine, Errands& errands) {
  auto& part = parts_[machine];
  if (part.stage == Part::Stage::asked || part.stage == Part::Stage::ended ||
      part.stage == Part::Stage::foreign || part.stopping)
    return;
  part.stopping = true;
  errands.push_back({.kind = Errand::Kind::cancel, .machine = machine});
}

void GroupMoveMachine::end_if_over() {
  const bool left = std::ranges::any_of(parts_, [this](const Part& part) {
    return part.stage != Part::Stage::ended &&
           !(state_ == State::giving_up && part.stage == Part::Stage::foreign);
  });
  if (!left && (state_ == State::giving_up || state_ == State::attached)) state_ = State::over;
}

/// What was told by this entrance is not renewed any more, and starts nothing; the other entrance decides.
void GroupMoveMachine::attach() { state_ = State::attached; }

bool GroupMoveMachine::reached(axisd::v1::WaitUntil until) const {
  if (state_ == State::over) return true;
  if (state_ != State::running && state_ != State::attached) return false;
  if (until == axisd::v1::WAIT_UNTIL_STARTED)
    return std::ranges::all_of(
        parts_, [](const Part& part) { return part.move.state() != axisd::v1::COMMAND_STATE_ACCEPTED; });
  return until != axisd::v1::WAIT_UNTIL_DONE;
}

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
      std::ranges::any_of(parts_, is_left_open, &Part::move))
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

v1::CellGroupMove GroupMoveMachine::value() const {
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
    const TimePoint by_its_clock(of(preparation.first_start()));
    const auto near = parts_[i].clock.at(by_its_clock);
    if (!near) return;  // another entrance knows
    const auto clock = *parts_[i].clock.at(by_its_clock - near->offset);
    starts[i] = by_its_clock - clock.offset;
    all_started = all_started && move.has_start_skew();
    first = first ? std::min(*first, *starts[i]) : *starts[i];
    const auto latest = *starts[i] + of(move.start_skew());
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
