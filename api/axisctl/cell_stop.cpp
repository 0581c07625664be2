// StopAll of a cell, and its release.
#include <fmt/format.h>

#include "api/axisctl/across.hpp"
#include "api/axisctl/cell_commands.hpp"
#include "api/axisctl/cell_view.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/repetition.hpp"
#include "api/axisctl/stop_results.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = cell::v1::CellService::Stub;

constexpr std::string_view remedy =
    "ask another entrance of the cell, or each machine itself: axisctl --server MACHINE stop --all";

cell::v1::StopAllResponse ask(Invocation& invocation) {
  const auto& client = invocation.client();
  try {
    return repeat_stop(client, &Stub::StopAll, cell::v1::StopAllRequest(), "", client.timeout());
  } catch (const Failure& failure) {
    if (failure.code() != ExitCode::unreachable) throw;
    throw failure.saying(fmt::format("{}; {}", failure.what(), remedy));
  }
}

/// Of a latch that is not where it should be: the machines stand all the same.
void complain_of(Invocation& invocation, const v1::ErrorDetail& error) {
  complain({ExitCode::ended_otherwise, describe(error), error}, invocation.json);
}

/// To stop twice is harmless, and this one waits for standstill.
void confirm(Invocation& invocation, cell::v1::StopAllResponse& response) {
  std::vector<std::string> machines;
  for (const auto& stop : response.machines())
    if (stop.outcome() == cell::v1::MACHINE_OUTCOME_DONE) machines.push_back(stop.machine());
  v1::StopAllRequest request;
  request.set_wait_until(v1::WAIT_UNTIL_DONE);
  const auto confirmed = ask_machines(invocation.client(), machines, &v1::SystemService::Stub::StopAll,
                                      request, std::chrono::nanoseconds(0));
  for (const auto& answer : confirmed)
    for (auto& stop : *response.mutable_machines()) {
      if (stop.machine() != answer.machine) continue;
      if (answer.response) *stop.mutable_response() = *answer.response;
    }
  tell_failures(invocation, confirmed);
}

}  // namespace

void stop_cell(Invocation& invocation, bool wait) {
  auto response = ask(invocation);
  for (auto& stop : *response.mutable_machines()) put_machine(*stop.mutable_response(), stop.machine());
  if (wait) confirm(invocation, response);
  if (invocation.json) print_line(json(response));
  for (const auto& stop : response.machines()) {
    if (stop.outcome() != cell::v1::MACHINE_OUTCOME_DONE) invocation.status = ExitCode::ended_otherwise;
    if (!invocation.json) print_line(stop_line(stop, use_colour()));
    print_results(invocation, stop.response(), wait ? Results::all : Results::failed);
    complain_of_latch(invocation, stop.response());
  }
  if (response.machines().empty())
    throw Failure(ExitCode::ended_otherwise,
                  fmt::format("the entrance knows no machine, none was stopped; {}", remedy));
  if (!invocation.json)
    print_line(
        "all motion in the cell is refused until 'axisctl release-stop --all'; a machine that comes back is "
        "told so before");
  if (response.has_not_durable()) {
    complain_of(invocation, response.not_durable());
    invocation.status = ExitCode::ended_otherwise;
  }
  if (response.has_not_shared()) complain_of(invocation, response.not_shared());
}

void release_cell(Invocation& invocation) {
  const auto response =
      invocation.client().call(&Stub::ReleaseStopAll, cell::v1::ReleaseStopAllRequest(), "");
  if (invocation.json) print_line(json(response));
  for (const auto& release : response.machines()) {
    if (release.outcome() != cell::v1::MACHINE_OUTCOME_DONE) invocation.status = ExitCode::ended_otherwise;
    if (!invocation.json) print_line(release_line(release, use_colour()));
  }
  if (!invocation.json)
    print_line(fmt::format(
        "{}; every axis needs a new command to move",
        response.released().empty() ? "the cell itself was not stopped" : "the cell is released"));
  if (response.has_not_durable()) {
    complain_of(invocation, response.not_durable());
    invocation.status = ExitCode::ended_otherwise;
  }
  if (response.has_not_shared()) complain_of(invocation, response.not_shared());
}

}  // namespace axisd::axisctl
