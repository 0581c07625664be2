// jog: moves for as long as the program runs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/lease_option.hpp"
#include "api/axisctl/motion_arguments.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/command_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using std::chrono::milliseconds;
using Stub = v1::AxisService::Stub;

struct JogArguments : MotionArguments {
  std::string lasts;  ///< --for
};

/// The jog request of these arguments. Repeating it extends the hold; it never starts a jog anew that has
/// ended.
v1::JogRequest jog_request(const JogArguments& arguments, const std::string& unit,
                           std::chrono::nanoseconds hold) {
  v1::JogRequest request;
  request.set_axis(arguments.axis());
  request.set_velocity(parse_value(arguments.value, unit + "/s", "velocity"));
  set(*request.mutable_hold(), hold);
  set_ramps(request, arguments);
  *request.mutable_options() = command_options(arguments);
  return request;
}

/// Renews until Ctrl-C, the end of --for or the end of the motion. Returns the command as last seen.
v1::Command renew(Invocation& invocation, const JogArguments& arguments, const Interrupt& interrupt,
                  v1::JogRequest request, v1::Command command, std::chrono::nanoseconds hold) {
  const bool endless = arguments.lasts.empty();
  auto left = endless ? std::chrono::nanoseconds(0) : parse_duration(arguments.lasts, "--for");
  while (!ended(command) && (endless || left.count() > 0)) {
    // Three renewals per hold: two may be late or lost before the axis halts.
    const auto pause = endless ? hold / 3 : std::min(hold / 3, left);
    left -= pause;
    if (interrupt.wait_for(std::chrono::ceil<milliseconds>(pause))) break;
    if (!endless && left.count() <= 0) break;
    const auto id = request.options().request_id();
    *request.mutable_options() = command_options(arguments);
    request.mutable_options()->set_request_id(id);
    command =
        invocation.client().call_within(hold, &Stub::Jog, request, arguments.axis(), Lane::stop).command();
  }
  return command;
}

void jog(Invocation& invocation, const JogArguments& arguments) {
  const auto before = invocation.state(arguments.axis());
  const auto hold = parse_duration(arguments.hold, "--hold");
  if (hold < milliseconds(30) || hold > std::chrono::seconds(2))
    throw Failure(ExitCode::usage,
                  fmt::format("--hold: '{}' is out of range (permitted 30ms to 2s)", arguments.hold));
  const auto request = jog_request(arguments, before.unit(), hold);
  // The wait itself sees the request; nothing else has to happen on a thread of its own.
  const Interrupt interrupt([] {});
  v1::Command command = send(invocation, &Stub::Jog, request, Lane::stop);
  if (!invocation.json) print_line(command_line(command, before.unit()));
  try {
    command = renew(invocation, arguments, interrupt, request, command, hold);
  } catch (const Failure& failure) {
    // Without renewal the hold expires and the daemon halts the axis; asking for it as well is quicker if it
    // can.
    try {
      halt_axis(invocation, arguments.axis(), hold);
    } catch (const Failure&) {
      throw failure.saying(
          fmt::format("{}; the axis halts when its hold of {} ends", failure.what(), arguments.hold));
    }
    throw;
  }
  if (ended(command)) {
    invocation.status = report(invocation, {command}, false, {.unit = before.unit(), .start = {}});
    return;
  }
  invocation.status =
      follow(invocation, halt_axis(invocation, arguments.axis(), invocation.client().timeout()),
             {.unit = before.unit(), .start = {}});
}

}  // namespace

void add_jog_command(CLI::App& app, Invocation& invocation) {
  auto* command = app.add_subcommand("jog", "Move while this program runs; Ctrl-C halts");
  const auto arguments = std::make_shared<JogArguments>();
  arguments->hold = "300ms";
  add_axis(*command, *arguments);
  command->add_option("VALUE", arguments->value, "Signed, per second: 5mm/s, -5")->required();
  command->add_option("--for", arguments->lasts, "Halt after this time: 2s")->type_name("TIME");
  command
      ->add_option("--hold", arguments->hold,
                   "The axis halts by itself this long after the last renewal (30ms to 2s)")
      ->type_name("TIME")
      ->capture_default_str();
  add_ramps(*command, *arguments);
  add_lease(*command, arguments->lease_token);
  command->callback([&invocation, arguments] { jog(invocation, *arguments); });
}

}  // namespace axisd::axisctl
