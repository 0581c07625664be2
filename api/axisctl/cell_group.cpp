// A move of axes of several machines.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string_view>

#include "api/axisctl/cell_commands.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = cell::v1::CellService::Stub;

cell::v1::MachineTargets& part_of(cell::v1::MoveGroupRequest& request, std::string_view machine) {
  for (auto& part : *request.mutable_machines())
    if (part.machine() == machine) return part;
  auto& part = *request.add_machines();
  part.set_machine(std::string(machine));
  return part;
}

cell::v1::MoveGroupRequest request_of(const Invocation& invocation, const v1::MoveGroupRequest& move) {
  if (!move.group().empty() || move.arrive_together() || move.has_max_arrival_error())
    throw Failure(
        ExitCode::usage,
        "over several machines axes are named one by one, and each arrives when it does: leave out the "
        "group, --together and --max-arrival-error");
  if (move.options().lease_token() != 0 && invocation.connection.lease_machine.empty())
    throw Failure(ExitCode::usage, "whose lease is it? write --lease MACHINE/TOKEN");
  cell::v1::MoveGroupRequest request;
  for (const auto& target : move.targets()) {
    const auto named = machine_in(target.axis());
    const auto machine = named.empty() ? std::string_view(invocation.connection.machine) : named;
    if (machine.empty())
      throw Failure(ExitCode::usage,
                    fmt::format("'{0}' names no machine of the cell; write MACHINE/{0}", target.axis()));
    auto& part = part_of(request, machine);
    *part.add_targets() = target;
    part.mutable_targets()->rbegin()->set_axis(std::string(without_machine(target.axis())));
    // Each machine counts its own tokens.
    if (invocation.connection.lease_machine == machine) part.set_lease_token(move.options().lease_token());
  }
  *request.mutable_options() = move.options();
  request.mutable_options()->clear_lease_token();
  request.mutable_options()->clear_buffer_mode();
  return request;
}

std::string after(const google::protobuf::Duration& time) { return "+" + duration_text(seconds(time)); }

google::protobuf::Duration sum(const google::protobuf::Duration& a, const google::protobuf::Duration& b) {
  const auto total = (a.seconds() + b.seconds()) * 1'000'000'000 + a.nanos() + b.nanos();
  google::protobuf::Duration to;
  to.set_seconds(total / 1'000'000'000);
  to.set_nanos(static_cast<int>(total % 1'000'000'000));
  return to;
}

void print(const cell::v1::CellGroupMove& move) {
  print_line(fmt::format("{}{}", lower_word(v1::CommandState_Name(move.state()), "COMMAND_STATE_"),
                         move.has_cause() ? ": " + describe(move.cause()) : ""));
  Table table({"AXIS", "STATE", "COMMAND", "PREDICTED", "STARTED", "ARRIVED"}, {3, 4, 5});
  for (const auto& machine : move.machines())
    for (const auto& member : machine.move().members()) {
      const bool started = machine.has_started_after() && member.has_started_after();
      const bool arrived = machine.has_started_after() && member.has_arrived_after();
      table.add({member.command().axis(), command_state(member.command()), member.command().id(),
                 duration_text(seconds(member.predicted_duration())),
                 started ? after(sum(machine.started_after(), member.started_after())) : "-",
                 arrived ? after(sum(machine.started_after(), member.arrived_after())) : "-"});
    }
  table.print(use_colour());
  for (const auto& machine : move.machines())
    if (machine.has_error()) print_line(describe(machine.error(), machine.machine()));
  if (move.has_start_skew())
    print_line(fmt::format("start skew {}, off by {} at most", duration_text(seconds(move.start_skew())),
                           duration_text(seconds(move.start_skew_error()))));
}

}  // namespace

bool names_several_machines(const Invocation& invocation, const v1::MoveGroupRequest& move) {
  if (!invocation.connection.through_entrance() || move.targets().empty()) return false;
  const auto first = machine_in(move.targets(0).axis());
  return std::ranges::any_of(move.targets(),
                             [&](const auto& target) { return machine_in(target.axis()) != first; });
}

void move_cell_group(Invocation& invocation, const v1::MoveGroupRequest& move,
                     const google::protobuf::Duration* clock_tolerance) {
  auto request = request_of(invocation, move);
  if (clock_tolerance != nullptr) *request.mutable_clock_tolerance() = *clock_tolerance;
  const auto& client = invocation.client();
  const bool wait = move.options().wait_until() == v1::WAIT_UNTIL_DONE;
  auto done = client
                  .call_within(wait ? std::chrono::nanoseconds(0) : client.timeout(), &Stub::MoveGroup,
                               request, std::string_view())
                  .move();
  for (auto& machine : *done.mutable_machines()) {
    put_machine(*machine.mutable_move(), machine.machine());
    for (const auto& member : machine.move().members()) invocation.note_started(member.command());
  }
  if (done.state() == v1::COMMAND_STATE_ABORTED || done.state() == v1::COMMAND_STATE_ERROR ||
      done.state() == v1::COMMAND_STATE_UNKNOWN)
    invocation.status = ExitCode::ended_otherwise;
  if (invocation.json) return print_line(json(done));
  print(done);
}

}  // namespace axisd::axisctl
