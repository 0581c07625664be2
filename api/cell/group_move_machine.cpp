#include "api/cell/group_move_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/cell/roster.hpp"
#include "api/cell/status.hpp"

namespace axisd::cell {
namespace {

axisd::v1::ErrorDetail told_too_late() {
  return detail_of(axisd::v1::REASON_EXPIRED, "it took too long until all machines were told to start",
                   "repeat the move with another request_id; look at the network if it is often so");
}

std::string milliseconds(Duration time) {
  return fmt::format("{:.3f} ms", std::chrono::duration<double, std::milli>(time).count());
}

}  // namespace

bool has_ended(axisd::v1::CommandState state) {
  return state == axisd::v1::COMMAND_STATE_DONE || state == axisd::v1::COMMAND_STATE_ABORTED ||
         state == axisd::v1::COMMAND_STATE_ERROR || state == axisd::v1::COMMAND_STATE_UNKNOWN;
}

bool was_told(const axisd::v1::GroupMove& move) {
  return move.state() == axisd::v1::COMMAND_STATE_ACTIVE || move.preparation().has_starts_at();
}

GroupMoveMachine::GroupMoveMachine(std::vector<std::string> machines, const Limits& limits)
    : limits_(limits) {
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
  google::protobuf::RepeatedPtrField<axisd::v1::GroupMember> members;
  members.Swap(part.move.mutable_members());
  part.move = move;
  if (move.members().empty()) {
    // A renewal does not tell them. Once it is active, none of them waits.
    part.move.mutable_members()->Swap(&members);
    for (auto& member : *part.move.mutable_members())
      if (move.state() == axisd::v1::COMMAND_STATE_ACTIVE &&
          member.command().state() == axisd::v1::COMMAND_STATE_ACCEPTED)
        member.mutable_command()->set_state(axisd::v1::COMMAND_STATE_ACTIVE);
  }
  const auto& preparation = move.preparation();
  const bool elsewhere =
      was_told(move) &&
      (!part.at || (preparation.has_starts_at() && duration_of(preparation.starts_at()) != *part.at));
  if (elsewhere) {
    may_have_started_ = true;
    part.stage = Part::Stage::foreign;
  }
  if (has_ended(move.state())) part.stage = Part::Stage::ended;
  if (elsewhere && state_ != State::preparing) attach();
}

GroupMoveMachine::Errands GroupMoveMachine::prepared(std::size_t machine, const Answer& answer) {
  auto& part = parts_[machine];
  if (answer.status.ok()) {
    part.stage = Part::Stage::prepared;
    take(part, answer.move);
    // It has ended before this answer: who knows in which attempt.
    if (part.stage == Part::Stage::ended) may_have_started_ = true;
  } else {
    part.stage = Part::Stage::lost;
    part.error = detail_of(answer.status);
    if (refusal_.ok()) refusal_ = to_status(answer.status.error_code(), named(*part.error, part.machine));
  }
  return any(Part::Stage::asked) ? Errands{} : judge_prepared(answer.received);
}

/// All have answered. A request that is repeated finds what became of it before.
GroupMoveMachine::Errands GroupMoveMachine::judge_prepared(TimePoint now) {
  Errands errands;
  if (any(Part::Stage::foreign)) {
    attach();
  } else if (!refusal_.ok()) {
    return give_up(detail_of(refusal_), refusal_.error_code(), now);
  } else if (all(Part::Stage::ended)) {
    end();
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
  if (state_ == State::attached || state_ == State::over) return false;
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
  if (error > limits_.clock_tolerance)
    return give_up(
        detail_of(
            axisd::v1::REASON_OUT_OF_RANGE,
            fmt::format("{}: its clock is known to {} only, {} are allowed (clock_tolerance)",
                        parts_[machine].machine, milliseconds(error), milliseconds(limits_.clock_tolerance)),
            "allow more, or look at the network between the machines and at their load"),
        grpc::StatusCode::OUT_OF_RANGE, answer.received);
  const bool all_known =
      std::ranges::all_of(parts_, [](const Part& part) { return part.clock.count() >= round_trips; });
  return all_known ? choose_moment(answer.received) : errands;
}

/// As soon as all can be told, and every one has had its last look at its members.
GroupMoveMachine::Errands GroupMoveMachine::choose_moment(TimePoint now) {
  Duration notice{};
  for (const auto& part : parts_) notice = std::max(notice, duration_of(part.move.preparation().notice()));
  const auto moment = now + notice + lead;
  if (moment > limits_.start_by)
    return give_up(
        detail_of(axisd::v1::REASON_EXPIRED,
                  "the caller does not wait until all could start together, so nothing was started",
                  "give the call a longer deadline; if it is often so, look at the machine that "
                  "takes longest to prepare"),
        grpc::StatusCode::DEADLINE_EXCEEDED, now);
  Errands errands;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto at = (moment + parts_[i].clock.at(now)->offset).time_since_epoch();
    if (at > duration_of(parts_[i].move.preparation().expires()))
      return give_up(
          detail_of(axisd::v1::REASON_EXPIRED,
                    fmt::format("{}: it took too long until all machines were prepared", parts_[i].machine),
                    "repeat the move with another request_id; if it is often so, name fewer axes, or look "
                    "at the machine that takes longest"),
          grpc::StatusCode::DEADLINE_EXCEEDED, now);
    errands.push_back({.kind = Errand::Kind::tell, .machine = i, .at = at});
  }
  for (const auto& errand : errands) parts_[errand.machine].at = errand.at;
  may_have_started_ = true;
  latest_told_ = now + lead / 2;  // the rest is for the word that all were
  state_ = State::telling;
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::told(std::size_t machine, const Answer& answer) {
  Errands errands;
  auto& part = parts_[machine];
  if (is_out(part) || (state_ != State::telling && state_ != State::giving_up)) return errands;
  if (!answer.status.ok() && detail_of(answer.status).reason() == axisd::v1::REASON_REQUEST_ID_CONFLICT) {
    part.stage = Part::Stage::foreign;
    attach();
    return errands;
  }
  if (state_ == State::giving_up) return take_while_giving_up(machine, answer);
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
  if (all(Part::Stage::ended)) end();
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::renewed(std::size_t machine, const Answer& answer) {
  Errands errands;
  auto& part = parts_[machine];
  if (part.stage == Part::Stage::ended) return errands;  // another answer was faster
  if (state_ == State::giving_up) return take_while_giving_up(machine, answer);
  if (state_ != State::running && state_ != State::telling) return errands;
  const bool has_started = part.move.preparation().has_first_start();
  if (!goes_on(machine, answer, errands)) return errands;
  // Later ones would push out those that are nearest to its start, which tell best when that was.
  if (!has_started) part.clock.add(answer.sent, answer.received, answer.clock);
  if (state_ == State::running && all(Part::Stage::ended)) end();
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
  if (state_ == State::giving_up) return take_while_giving_up(machine, answer);
  if (state_ != State::attached || is_out(part)) return {};
  if (answer.status.ok()) {
    part.silent_since.reset();
    take(part, answer.move);
  } else {
    auto error = detail_of(answer.status);
    if (!part.silent_since) part.silent_since = answer.sent;
    if (error.reason() == axisd::v1::REASON_UNKNOWN_COMMAND ||
        answer.received - *part.silent_since >= longest_silence) {
      part.error = std::move(error);
      part.stage = Part::Stage::lost;
    }
  }
  end_if_over();
  return {};
}

GroupMoveMachine::Errands GroupMoveMachine::take_while_giving_up(std::size_t machine, const Answer& answer) {
  auto& part = parts_[machine];
  Errands errands;
  if (is_out(part)) return errands;
  if (answer.status.ok()) {
    take(part, answer.move);
    if (state_ == State::giving_up && was_told(part.move)) stop_part(machine, errands);
  } else if (detail_of(answer.status).reason() == axisd::v1::REASON_UNKNOWN_COMMAND) {
    part.error = detail_of(answer.status);  // its axisd was started anew, which starts nothing
    part.stage = Part::Stage::ended;
  }
  end_if_over();
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::tick(TimePoint now) {
  Errands errands;
  if (state_ == State::telling && now > latest_told_)
    return give_up(told_too_late(), grpc::StatusCode::ABORTED, now);
  if (state_ == State::giving_up && now >= end_by_) {
    end();
    return errands;
  }
  const bool renews = state_ == State::telling || state_ == State::running;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    auto& part = parts_[i];
    if (is_out(part) || now < part.next) continue;
    if (renews && part.stage == Part::Stage::told) {
      part.next = now + renewal_period;
      errands.push_back({.kind = Errand::Kind::renew, .machine = i, .all_told = state_ == State::running});
    } else if (state_ == State::giving_up) {
      end_part(i, now, errands);
    } else if (state_ == State::attached) {
      part.next = now + look_period;
      errands.push_back({.kind = Errand::Kind::look, .machine = i});
    }
  }
  return errands;
}

GroupMoveMachine::Errands GroupMoveMachine::fail(std::size_t machine, const grpc::Status& status,
                                                 TimePoint now) {
  return give_up(named(detail_of(status), parts_[machine].machine), status.error_code(), now);
}

GroupMoveMachine::Errands GroupMoveMachine::give_up(axisd::v1::ErrorDetail cause, grpc::StatusCode code,
                                                    TimePoint now) {
  refusal_ = to_status(code, cause);
  cause_ = std::move(cause);
  state_ = State::giving_up;
  end_by_ = now + longest_end;
  Errands errands;
  for (std::size_t i = 0; i < parts_.size(); ++i) end_part(i, now, errands);
  end_if_over();
  return errands;
}

void GroupMoveMachine::end_part(std::size_t machine, TimePoint now, Errands& errands) {
  auto& part = parts_[machine];
  if (is_out(part)) return;
  part.next = now + look_period;
  if (part.stage == Part::Stage::told || was_told(part.move)) {
    stop_part(machine, errands);
  } else {
    if (!part.at) part.at = duration_of(part.move.preparation().expires());
    errands.push_back({.kind = Errand::Kind::tell, .machine = machine, .at = *part.at});
  }
  errands.push_back({.kind = Errand::Kind::look, .machine = machine});
}

void GroupMoveMachine::stop_part(std::size_t machine, Errands& errands) {
  auto& part = parts_[machine];
  if (is_out(part) || part.stopping) return;
  part.stopping = true;
  errands.push_back({.kind = Errand::Kind::cancel, .machine = machine});
}

void GroupMoveMachine::end_if_over() {
  if (std::ranges::all_of(parts_, is_out) && (state_ == State::giving_up || state_ == State::attached)) end();
}

void GroupMoveMachine::end() {
  state_ = State::over;
  ended_as_ = make_value();
  for (auto& part : parts_) {
    part.move.Clear();
    part.clock = {};
  }
}

/// What was told by this entrance is not renewed any more, and starts nothing; the other entrance decides.
void GroupMoveMachine::attach() {
  may_have_started_ = true;
  cause_.reset();  // why this entrance would not go on
  state_ = State::attached;
  end_if_over();
}

bool GroupMoveMachine::reached(axisd::v1::WaitUntil until) const {
  if (state_ == State::over) return true;
  if (state_ != State::running && state_ != State::attached) return false;
  if (until == axisd::v1::WAIT_UNTIL_STARTED)
    return std::ranges::all_of(
        parts_, [](const Part& part) { return part.move.state() != axisd::v1::COMMAND_STATE_ACCEPTED; });
  return until != axisd::v1::WAIT_UNTIL_DONE;
}

}  // namespace axisd::cell
