// explain: why an axis cannot be commanded now.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <initializer_list>
#include <memory>
#include <string_view>
#include <utility>

#include "api/axisctl/explain_view.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/lease_option.hpp"
#include "api/axisctl/motion_arguments.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

constexpr const char* examples = R"(
Ends with status 4 if the command would be refused, and with 0 if not.

Examples:
  axisctl explain feeder                                why can it not move?
  axisctl explain feeder move 120mm --velocity 50mm/s   and this move?
  axisctl explain feeder enable)";

struct Arguments : MotionArguments {
  std::string command;
  bool relative = false;
};

void set_hold(auto& request, const Arguments& arguments) {
  if (!arguments.hold.empty()) set(*request.mutable_hold(), parse_duration(arguments.hold, "--hold"));
}

/// Commands with a value. The axis's unit is asked for only where there is one.
void ask_with_value(Invocation& invocation, const Arguments& arguments, v1::ExplainRequest& request) {
  if (arguments.value.empty())
    throw Failure(ExitCode::usage, fmt::format("explain {} needs a VALUE, as {} itself does",
                                               arguments.command, arguments.command));
  const auto unit = invocation.state(arguments.axis()).unit();
  const auto& command = arguments.command;
  if (command == "set-position") {
    request.mutable_set_position()->set_position(parse_value(arguments.value, unit, "position"));
  } else if (command == "move" && arguments.relative) {
    request.mutable_move_relative()->set_distance(parse_value(arguments.value, unit, "distance"));
    set_profile(*request.mutable_move_relative(), arguments, unit);
  } else if (command == "move") {
    request.mutable_move_absolute()->set_position(parse_value(arguments.value, unit, "position"));
    set_profile(*request.mutable_move_absolute(), arguments, unit);
  } else if (command == "velocity") {
    request.mutable_move_velocity()->set_velocity(parse_value(arguments.value, unit + "/s", "velocity"));
    set_hold(*request.mutable_move_velocity(), arguments);
    set_ramps(*request.mutable_move_velocity(), arguments);
  } else {
    request.mutable_jog()->set_velocity(parse_value(arguments.value, unit + "/s", "velocity"));
    set_hold(*request.mutable_jog(), arguments);
    set_ramps(*request.mutable_jog(), arguments);
  }
}

/// What a command does not take would be left out of the question without a word.
void check_belonging(const Arguments& arguments) {
  const auto is_one_of = [&](std::initializer_list<std::string_view> commands) {
    return std::ranges::find(commands, arguments.command) != commands.end();
  };
  const bool ramps = !arguments.acceleration_time.empty() || !arguments.deceleration_time.empty();
  const std::pair<std::string_view, bool> wrong[] = {
      {"VALUE", !arguments.value.empty() && !is_one_of({"move", "velocity", "jog", "set-position"})},
      {"--relative", arguments.relative && !is_one_of({"move"})},
      {"--velocity", !arguments.velocity.empty() && !is_one_of({"move"})},
      {"--hold", !arguments.hold.empty() && !is_one_of({"velocity", "jog"})},
      {"--acceleration-time or --deceleration-time", ramps && !is_one_of({"move", "velocity", "jog"})}};
  for (const auto& [what, given] : wrong)
    if (given)
      throw Failure(ExitCode::usage,
                    fmt::format("explain {} takes no {}",
                                arguments.command.empty() ? "without a command" : arguments.command, what));
}

void explain(Invocation& invocation, const Arguments& arguments) {
  check_belonging(arguments);
  v1::ExplainRequest request;
  request.set_axis(arguments.axis());
  request.set_lease_token(arguments.lease_token);
  const auto& command = arguments.command;
  if (command == "enable") {
    request.mutable_enable();
  } else if (command == "disable") {
    request.mutable_disable();
  } else if (command == "home") {
    request.mutable_home();
  } else if (command == "reset") {
    request.mutable_reset();
  } else if (!command.empty()) {
    ask_with_value(invocation, arguments, request);
  }
  const auto response =
      invocation.client().call(&v1::SystemService::Stub::Explain, request, arguments.axis());
  print(invocation.json ? json(response) + "\n"
                        : explanation(response, arguments.axis(), command, use_colour()));
  if (is_blocked(response)) invocation.status = ExitCode::refused;
}

}  // namespace

void add_explain_command(CLI::App& app, Invocation& invocation) {
  const auto arguments = std::make_shared<Arguments>();
  auto* command = app.add_subcommand(
      "explain", "Why an axis cannot move, or a command would be refused, and what to do about it");
  command->footer(examples);
  add_axis(*command, *arguments);
  command
      ->add_option("COMMAND", arguments->command, "The command that is asked about; none: motion in general")
      ->check(
          CLI::IsMember({"enable", "disable", "home", "move", "velocity", "jog", "reset", "set-position"}));
  command->add_option("VALUE", arguments->value, "As of the command: 120mm, -20mm/s");
  command->add_flag("--relative", arguments->relative, "VALUE is a distance, as of move");
  command->add_option("--velocity", arguments->velocity, "Of a move, per second: 50mm/s")->type_name("VALUE");
  command->add_option("--hold", arguments->hold, "Of velocity and jog: 500ms")->type_name("TIME");
  add_ramps(*command, *arguments);
  add_lease(*command, arguments->lease_token);
  command->callback([&invocation, arguments] { explain(invocation, *arguments); });
}

}  // namespace axisd::axisctl
