#include "api/axisctl/motion_arguments.hpp"

#include <CLI/CLI.hpp>

#include "api/axisctl/duration.hpp"
#include "api/axisctl/lease_option.hpp"
#include "api/axisctl/quantity.hpp"

namespace axisd::axisctl {

void add_axis(CLI::App& command, MotionArguments& arguments) {
  // A vector would swallow the arguments behind it.
  arguments.axes.resize(1);
  command.add_option("AXIS", arguments.axes.front(), "Name of the axis")->required();
}

void add_several_axes(CLI::App& command, MotionArguments& arguments) {
  command.add_option("AXIS", arguments.axes, "Names of one or more axes, with spaces or commas between")
      ->delimiter(',');
}

void add_ramps(CLI::App& command, MotionArguments& arguments) {
  command
      .add_option("--acceleration-time", arguments.acceleration_time, "From start speed to velocity: 150ms")
      ->type_name("TIME");
  command
      .add_option("--deceleration-time", arguments.deceleration_time, "From velocity to standstill: 150ms")
      ->type_name("TIME");
}

void add_options(CLI::App& command, MotionArguments& arguments) {
  command
      .add_option("--request-id", arguments.request_id,
                  "Repeat an earlier invocation: attaches to its command instead of moving twice")
      ->type_name("ID");
  command
      .add_option("--valid-for", arguments.valid_for,
                  "Send nothing to the drive after this time (default 60s)")
      ->type_name("TIME");
  add_lease(command, arguments.lease_token);
}

void add_wait(CLI::App& command, MotionArguments& arguments) {
  command.add_flag("--wait", arguments.wait, "Follow the command until it has ended; status 0 only for Done");
}

v1::CommandOptions command_options(const MotionArguments& arguments) {
  v1::CommandOptions options;
  options.set_request_id(arguments.request_id.empty() ? random_uuid() : arguments.request_id);
  options.set_lease_token(arguments.lease_token);
  options.set_wait_until(v1::WAIT_UNTIL_ACCEPTED);
  if (arguments.buffered) options.set_buffer_mode(v1::BUFFER_MODE_BUFFERED);
  if (!arguments.valid_for.empty())
    set_ahead(*options.mutable_not_after(), parse_duration(arguments.valid_for, "--valid-for"));
  return options;
}

}  // namespace axisd::axisctl
