// Options that motion subcommands have in common.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/axisctl/duration.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/quantity.hpp"

namespace axisd::axisctl {

struct MotionArguments {
  std::vector<std::string> axes;
  std::string value, velocity, acceleration_time, deceleration_time, hold, valid_for, request_id;
  std::uint64_t lease_token = 0;
  bool wait = false, buffered = false, halt_on_interrupt = false;

  [[nodiscard]] const std::string& axis() const { return axes.front(); }
};

void add_axis(CLI::App& command, MotionArguments& arguments);          ///< exactly one
void add_several_axes(CLI::App& command, MotionArguments& arguments);  ///< one or more
void add_ramps(CLI::App& command, MotionArguments& arguments);         ///< the two ramp times
void add_options(CLI::App& command, MotionArguments& arguments);       ///< request id, lease, validity
void add_wait(CLI::App& command, MotionArguments& arguments);

/// What the wire wants of them. Without --request-id each axis gets a fresh one, stored back into
/// `arguments`. Throws Failure (usage).
v1::CommandOptions command_options(const MotionArguments& arguments);

/// Fills what all requests with a velocity profile share.
void set_ramps(auto& request, const MotionArguments& arguments) {
  if (!arguments.acceleration_time.empty())
    set(*request.mutable_acceleration_time(),
        parse_duration(arguments.acceleration_time, "--acceleration-time"));
  if (!arguments.deceleration_time.empty())
    set(*request.mutable_deceleration_time(),
        parse_duration(arguments.deceleration_time, "--deceleration-time"));
}

/// The same, of requests whose velocity is an option.
void set_profile(auto& request, const MotionArguments& arguments, const std::string& unit) {
  if (!arguments.velocity.empty())
    request.set_velocity(parse_value(arguments.velocity, unit + "/s", "--velocity"));
  set_ramps(request, arguments);
}

/// Sends one motion call. A failure that leaves open whether the call arrived names the request id to repeat
/// it with.
template <class Response, class Stub, class Request>
v1::Command send(Invocation& invocation,
                 grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                 const Request& request, Lane lane = Lane::ordinary) {
  try {
    const auto command = invocation.client().call(method, request, request.axis(), lane).command();
    invocation.note_started(command);
    return command;
  } catch (const Failure& failure) {
    if (failure.code() != ExitCode::unreachable || failure.nothing_sent()) throw;
    throw failure.saying(std::string(failure.what()) + "; if the command may have arrived, repeat it with " +
                         "--request-id " + request.options().request_id());
  }
}

}  // namespace axisd::axisctl
