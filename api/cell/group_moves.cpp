#include "api/cell/group_moves.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>
#include <utility>

#include "api/cell/group_move_steps.hpp"
#include "api/cell/names.hpp"
#include "api/cell/roster.hpp"
#include "api/cell/status.hpp"
#include "api/tls/digest.hpp"
#include "axisd/v1/command_service.pb.h"
#include "buses/limited_log.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

using Kind = GroupMoveMachine::Errand::Kind;
using State = GroupMoveMachine::State;

/// A machine that is slow to prepare holds the others up, whose preparations last 2 s.
constexpr Duration prepare_patience = std::chrono::seconds(4);
constexpr Duration start_patience = std::chrono::milliseconds(400);
/// A machine that does not answer for so long is lost; it stops by itself at the same time.
constexpr Duration renewal_patience = std::chrono::milliseconds(450);
constexpr Duration cancel_patience = std::chrono::milliseconds(900);
constexpr Duration look_patience = std::chrono::milliseconds(900);
constexpr Duration tick_period = std::chrono::milliseconds(50);
constexpr Duration usual_tolerance = std::chrono::milliseconds(1);
constexpr Duration longest_tolerance = std::chrono::seconds(1);

grpc::Status invalid(std::string message, std::string remedy) {
  return to_status(grpc::StatusCode::INVALID_ARGUMENT, axisd::v1::REASON_INVALID_ARGUMENT, std::move(message),
                   std::move(remedy));
}

Duration tolerance_of(const v1::MoveGroupRequest& request) {
  return request.has_clock_tolerance() ? duration_of(request.clock_tolerance()) : usual_tolerance;
}

grpc::Status check_tolerance(const v1::MoveGroupRequest& request) {
  const auto& asked = request.clock_tolerance();
  const bool valid = asked.seconds() >= 0 && asked.nanos() >= 0 && asked.nanos() < 1'000'000'000;
  const auto tolerance = tolerance_of(request);
  if (valid && tolerance > Duration::zero() && tolerance <= longest_tolerance) return grpc::Status::OK;
  return invalid("clock_tolerance is no such time", "give more than 0 s, and at most 1 s");
}

int targets_of(const v1::MoveGroupRequest& request) {
  int targets = 0;
  for (const auto& part : request.machines()) targets += part.targets_size();
  return targets;
}

/// What this entrance keeps while the move is under way; what a target may be is for the owner of its axis.
grpc::Status check_size(const v1::MoveGroupRequest& request) {
  if (request.machines().empty() ||
      static_cast<std::size_t>(request.machines_size()) > GroupMoves::most_machines)
    return invalid("no machine is named, or too many are",
                   fmt::format("name 1 to {}, each with targets", GroupMoves::most_machines));
  for (const auto& part : request.machines())
    for (const auto& target : part.targets())
      if (target.axis().size() > GroupMoves::longest_name)
        return invalid(fmt::format("{}: the name of an axis has {} bytes", config::quoted(part.machine()),
                                   target.axis().size()),
                       fmt::format("names have {} at most", GroupMoves::longest_name));
  if (const int targets = targets_of(request); targets > GroupMoves::most_targets)
    return invalid(fmt::format("{} targets are given", targets),
                   fmt::format("give at most {} in one move", GroupMoves::most_targets));
  // With all that is not known here.
  if (request.ByteSizeLong() > GroupMoves::most_bytes)
    return invalid(fmt::format("the request has {} bytes", request.ByteSizeLong()),
                   fmt::format("give at most {}", GroupMoves::most_bytes));
  return grpc::Status::OK;
}

std::vector<std::string> names_of(const v1::MoveGroupRequest& request) {
  std::vector<std::string> names;
  for (const auto& part : request.machines()) names.push_back(part.machine());
  return names;
}

/// Of what a request with the same id has to have in common with it.
std::string digest_of(v1::MoveGroupRequest request) {
  request.mutable_options()->clear_wait_until();
  return tls::digest_of(request.SerializeAsString());
}

grpc::Status ended_in_motion() {
  return to_status(
      grpc::StatusCode::UNAVAILABLE, axisd::v1::REASON_CANCELLED,
      "axisd-cell is shutting down; the move may have run in part, and its machines stop it where "
      "no other entrance coordinates it",
      "repeat it with the same request_id at another entrance: that tells what became of it");
}

}  // namespace

struct GroupMoves::Run {
  Caller caller;
  std::string request_id, digest;
  v1::MoveGroupRequest request;  ///< empty once it is over
  int targets;
  Metadata metadata;
  TimePoint start_by;       ///< so long its caller waits
  std::vector<Way> ways{};  ///< of each machine, as they were at the beginning
  GroupMoveMachine machine;
  GroupMoveSteps steps{};
  struct Waiter {
    axisd::v1::WaitUntil until;
    Answer answer;
  };
  std::vector<Waiter> waiters{};
  Clock::Timer timer{};

  [[nodiscard]] bool over() const { return machine.state() == State::over; }
};

grpc::Status GroupMoves::check(const Caller& caller, const v1::MoveGroupRequest& request) {
  if (!caller.local && caller.role < CellRole::operator_)
    return to_status(grpc::StatusCode::PERMISSION_DENIED, axisd::v1::REASON_ACCESS_DENIED,
                     fmt::format("{} has the role {} at this entrance", config::quoted(caller.name),
                                 to_string(caller.role)),
                     "an operator may do it: `roles` of cell.yaml says who is one");
  if (!Callers::metadata_for(caller))
    return to_status(
        grpc::StatusCode::PERMISSION_DENIED, axisd::v1::REASON_ACCESS_DENIED,
        fmt::format("{} is a name that axisd does not take from a delegate", config::quoted(caller.name)),
        "use a certificate with a name of at most 64 characters without spaces");
  const auto& options = request.options();
  // The rest is for the owners of the axes.
  if (options.request_id().empty() || options.request_id().size() > 128)
    return invalid("options.request_id is missing, or longer than 128 characters",
                   "give each move an id of its own, such as a UUID");
  if (options.lease_token() != 0 || options.buffer_mode() != axisd::v1::BUFFER_MODE_UNSPECIFIED)
    return invalid("options.lease_token and options.buffer_mode have no meaning here",
                   "leave them out; the token of a lease is that of each machine");
  if (auto size = check_size(request); !size.ok()) return size;
  std::set<std::string> seen;
  for (const auto& part : request.machines())
    if (!is_machine_name(part.machine()) || part.targets().empty() || !seen.insert(part.machine()).second)
      return invalid(fmt::format("{} is no machine's name, has no targets, or is named twice",
                                 config::quoted(part.machine())),
                     "name each machine once, with its targets");
  return check_tolerance(request);
}

grpc::Status GroupMoves::check_room(const Caller& caller) const {
  const auto of_caller = std::ranges::count_if(
      runs_, [&](const RunPtr& run) { return !run->over() && run->caller.name == caller.name; });
  if (of_caller < most_of_one && open() < most) return grpc::Status::OK;
  return to_status(grpc::StatusCode::RESOURCE_EXHAUSTED, axisd::v1::REASON_BUSY,
                   fmt::format("{} moves of several machines are under way at this entrance", open()),
                   "wait until one has ended, or ask another entrance");
}

grpc::Status GroupMoves::connect(Run& run) const {
  const auto routes = routes_.now();
  for (const auto& part : run.request.machines()) {
    const auto found = routes->machines.find(part.machine());
    if (found == routes->machines.end())
      return to_status(grpc::StatusCode::NOT_FOUND, axisd::v1::REASON_INVALID_ARGUMENT,
                       fmt::format("no machine {} is known in this cell", config::quoted(part.machine())),
                       "CellService.ListMachines tells which there are");
    if (!found->second.open)
      return to_status(
          grpc::StatusCode::UNAVAILABLE, axisd::v1::REASON_OFFLINE,
          fmt::format("{}: {}", part.machine(), found->second.why),
          "check its power, its network, and that axisd runs there; nothing was sent by this entrance");
    run.ways.push_back(found->second.way);
  }
  return grpc::Status::OK;
}

GroupMoves::RunPtr GroupMoves::find(const Caller& caller, const std::string& request_id) const {
  const auto found = std::ranges::find_if(runs_, [&](const RunPtr& run) {
    return run->caller.name == caller.name && run->request_id == request_id;
  });
  return found == runs_.end() ? nullptr : *found;
}

void GroupMoves::move(const Caller& caller, const v1::MoveGroupRequest& request, TimePoint start_by,
                      Answer answer) {
  if (const auto valid = check(caller, request); !valid.ok()) return answer(valid, {});
  const auto until = request.options().wait_until();
  auto digest = digest_of(request);
  if (const auto known = find(caller, request.options().request_id())) {
    if (known->digest != digest)
      return answer(to_status(grpc::StatusCode::ALREADY_EXISTS, axisd::v1::REASON_REQUEST_ID_CONFLICT,
                              "this request_id was used for another move", "give each move an id of its own"),
                    {});
    known->waiters.push_back({.until = until, .answer = std::move(answer)});
    return settle(known);
  }
  if (const auto room = check_room(caller); !room.ok()) return answer(room, {});
  auto run = std::make_shared<Run>(
      Run{.caller = caller,
          .request_id = request.options().request_id(),
          .digest = std::move(digest),
          .request = request,
          .targets = targets_of(request),
          .metadata = *Callers::metadata_for(caller),
          .start_by = start_by,
          .machine = {names_of(request), {.clock_tolerance = tolerance_of(request), .start_by = start_by}}});
  if (const auto connected = connect(*run); !connected.ok()) return answer(connected, {});
  run->waiters.push_back({.until = until, .answer = std::move(answer)});
  runs_.push_back(run);
  forget_oldest();
  perform(run, run->machine.begin());
  tick(run);
}

int GroupMoves::open() const {
  return static_cast<int>(std::ranges::count_if(runs_, [](const RunPtr& run) { return !run->over(); }));
}

/// A machine still tells of some that are forgotten here.
void GroupMoves::forget_oldest() {
  std::size_t ended = 0;
  int targets = 0;
  for (auto run = runs_.end(); run != runs_.begin();) {
    if (!(*--run)->over()) continue;
    targets += (*run)->targets;
    if (++ended > most_ended || targets > most_ended_targets) run = runs_.erase(run);
  }
}

void GroupMoves::end(const grpc::Status& why) {
  for (const auto& run : std::exchange(runs_, {})) {
    run->timer.reset();
    const auto status = run->machine.may_have_started() ? ended_in_motion() : why;
    for (const auto& waiter : std::exchange(run->waiters, {})) waiter.answer(status, {});
  }
}

void GroupMoves::tick(const RunPtr& run) {
  run->timer = clock_.call_at(clock_.now() + tick_period, [this, weak = std::weak_ptr(run)] {
    const auto alive = weak.lock();
    if (!alive || alive->over()) return;
    tick(alive);
    perform(alive, alive->machine.tick(clock_.now()));
  });
}

/// It needs neither connections nor its request any more.
void GroupMoves::close(Run& run) {
  run.ways.clear();
  run.request.Clear();
  if (!run.machine.refusal().ok()) {
    ++tally_.refused;
    return;
  }
  const auto state = run.machine.value().state();
  ++(state == axisd::v1::COMMAND_STATE_DONE      ? tally_.done
     : state == axisd::v1::COMMAND_STATE_UNKNOWN ? tally_.unknown
                                                 : tally_.otherwise);
}

void GroupMoves::tell_steps(Run& run) const {
  const auto steps = run.steps.look(run.machine);
  if (steps.empty()) return;
  const auto value = run.machine.value();
  for (const auto step : steps) told_(event_of(step, value, run.caller.name, run.request_id));
}

/// Whoever waits hears what they wait for.
void GroupMoves::settle(const RunPtr& run) {
  tell_steps(*run);
  if (run->over() && !run->ways.empty()) close(*run);
  auto& waiters = run->waiters;
  for (auto waiter = waiters.begin(); waiter != waiters.end();) {
    if (!run->machine.reached(waiter->until)) {
      ++waiter;
      continue;
    }
    const auto answer = std::move(waiter->answer);
    waiter = waiters.erase(waiter);
    v1::MoveGroupResponse response;
    *response.mutable_move() = run->machine.value();
    answer(run->machine.refusal(), response);
  }
}

template <class Response>
auto GroupMoves::taker(const RunPtr& run, std::size_t machine, Event event) {
  return [this, weak = std::weak_ptr(run), machine, event, sent = clock_.now()](const grpc::Status& status,
                                                                                const Response& response) {
    const auto alive = weak.lock();
    if (!alive) return;
    GroupMoveMachine::Answer answer{
        .sent = sent, .received = clock_.now(), .status = status, .move = response.move()};
    if constexpr (requires { response.clock(); }) answer.clock = duration_of(response.clock());
    const auto before = alive->machine.state();
    const auto errands = (alive->machine.*event)(machine, answer);
    if (before != alive->machine.state() && alive->machine.state() == State::giving_up)
      log_limited(
          spdlog::level::warn, alive->caller.name, "group move",
          fmt::format("a move of several machines by {} ends: {}", config::printable(alive->caller.name),
                      config::printable(alive->machine.value().cause().message(), 256)));
    perform(alive, errands);
  };
}

void GroupMoves::perform(const RunPtr& run, const GroupMoveMachine::Errands& errands) {
  // Stops first: whatever else there is can wait for them.
  for (const bool stops : {true, false})
    for (const auto& errand : errands)
      if ((errand.kind == Kind::cancel) == stops) perform(run, errand);
  settle(run);
}

void GroupMoves::perform(const RunPtr& run, const GroupMoveMachine::Errand& errand) {
  switch (errand.kind) {
    case Kind::prepare:
      return prepare(run, errand.machine);
    case Kind::tell:
      return tell(run, errand.machine, errand.at);
    case Kind::measure:
    case Kind::renew:
      return renew(run, errand);
    case Kind::cancel:
      return cancel(run, errand.machine);
    case Kind::look:
      return look(run, errand.machine);
  }
}

void GroupMoves::prepare(const RunPtr& run, std::size_t machine) {
  const auto& part = run->request.machines(static_cast<int>(machine));
  axisd::v1::PrepareMoveRequest request;
  *request.mutable_move()->mutable_targets() = part.targets();
  auto& options = *request.mutable_move()->mutable_options();
  options = run->request.options();
  options.clear_wait_until();
  options.set_lease_token(part.lease_token());
  const auto left = std::max<Duration>(run->start_by - clock_.now(), std::chrono::milliseconds(1));
  using Response = axisd::v1::PrepareMoveResponse;
  ask<Response>(core_, run->ways[machine].main,
                {.path = "/axisd.v1.GroupService/PrepareMove",
                 .timeout = std::min(prepare_patience, left),
                 .metadata = run->metadata},
                request, taker<Response>(run, machine, &GroupMoveMachine::prepared));
}

void GroupMoves::tell(const RunPtr& run, std::size_t machine, Duration at) {
  axisd::v1::StartPreparedRequest request;
  request.set_id(run->machine.id_at(machine));
  set_duration(*request.mutable_at(), at);
  using Response = axisd::v1::StartPreparedResponse;
  ask<Response>(
      core_, run->ways[machine].main,
      {.path = "/axisd.v1.GroupService/StartPrepared", .timeout = start_patience, .metadata = run->metadata},
      request, taker<Response>(run, machine, &GroupMoveMachine::told));
}

void GroupMoves::renew(const RunPtr& run, const GroupMoveMachine::Errand& errand) {
  axisd::v1::RenewPreparedRequest request;
  request.set_id(run->machine.id_at(errand.machine));
  request.set_all_told(errand.all_told);
  using Response = axisd::v1::RenewPreparedResponse;
  ask_lane_first<Response>(core_, run->ways[errand.machine], "GroupService",
                           {.path = "RenewPrepared", .timeout = renewal_patience, .metadata = run->metadata},
                           request,
                           taker<Response>(run, errand.machine,
                                           errand.kind == Kind::measure ? &GroupMoveMachine::measured
                                                                        : &GroupMoveMachine::renewed));
}

/// Of all members: one that has ended already gives nobody up.
void GroupMoves::cancel(const RunPtr& run, std::size_t machine) {
  for (const auto& id : run->machine.commands_at(machine)) {
    axisd::v1::CancelCommandRequest request;
    request.set_id(id);
    ask_lane_first<axisd::v1::CancelCommandResponse>(
        core_, run->ways[machine], "CommandService",
        {.path = "CancelCommand", .timeout = cancel_patience, .metadata = run->metadata}, request,
        [this, weak = std::weak_ptr(run), machine](const grpc::Status& status,
                                                   const axisd::v1::CancelCommandResponse&) {
          if (const auto alive = weak.lock()) perform(alive, alive->machine.cancelled(machine, status));
        });
  }
}

void GroupMoves::look(const RunPtr& run, std::size_t machine) {
  axisd::v1::GetGroupMoveRequest request;
  request.set_id(run->machine.id_at(machine));
  using Response = axisd::v1::GetGroupMoveResponse;
  ask<Response>(
      core_, run->ways[machine].main,
      {.path = "/axisd.v1.GroupService/GetGroupMove", .timeout = look_patience, .metadata = run->metadata},
      request, taker<Response>(run, machine, &GroupMoveMachine::looked));
}

}  // namespace axisd::cell
