// group list|move|show|halt|stop|release-stop: axes that start and stop together.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <optional>

#include "api/axisctl/cell_commands.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/hold_view.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/motion_arguments.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/repetition.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/group_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::GroupService::Stub;

constexpr const char* examples = R"(
Examples:
  axisctl group move transfer feeder=100mm carousel=90deg --together --wait
  axisctl group move feeder=+5mm@20mm/s pusher=-5mm --relative      axes of this move alone
  axisctl --cell hall group move press-1/feeder=100mm press-2/arm=90deg      from one moment on
  axisctl group stop transfer)";

struct Arguments : MotionArguments {
  std::vector<std::string> words;  ///< of move: the group, if any, then targets
  std::string group, max_arrival_error, clock_tolerance;
  bool relative = false, together = false, keep = false;
};

std::string milliseconds_text(const google::protobuf::Duration& time) { return duration_text(seconds(time)); }

void list(Invocation& invocation) {
  const auto response =
      invocation.client().call(&Stub::ListGroups, v1::ListGroupsRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  if (response.groups().empty()) return print_line("no groups are configured");
  Table table({"GROUP", "AXES", "MAX ARRIVAL ERROR"}, {2});
  for (const auto& group : response.groups())
    table.add({group.name(), fmt::format("{}", fmt::join(group.axes(), ", ")),
               group.has_max_arrival_error() ? milliseconds_text(group.max_arrival_error()) : "-"});
  table.print(use_colour());
}

/// "feeder=120mm@50mm/s": axis, position or distance, and its velocity if it is not to be the axis's limit.
void add_target(Invocation& invocation, const Arguments& arguments, const std::string& word,
                v1::MoveGroupRequest& request) {
  const auto equals = word.find('=');
  auto& target = *request.add_targets();
  target.set_axis(word.substr(0, equals));
  auto value = word.substr(equals + 1);
  std::optional<std::string> velocity;
  if (const auto at = value.find('@'); at != std::string::npos) {
    velocity = value.substr(at + 1);
    value = value.substr(0, at);
  }
  const auto unit = invocation.state(target.axis()).unit();
  if (arguments.relative)
    target.set_distance(parse_value(value, unit, "distance"));
  else
    target.set_position(parse_value(value, unit, "position"));
  if (velocity) target.set_velocity(parse_value(*velocity, unit + "/s", "velocity"));
  if (!arguments.acceleration_time.empty())
    set(*target.mutable_acceleration_time(),
        parse_duration(arguments.acceleration_time, "--acceleration-time"));
  if (!arguments.deceleration_time.empty())
    set(*target.mutable_deceleration_time(),
        parse_duration(arguments.deceleration_time, "--deceleration-time"));
}

v1::MoveGroupRequest request_of(Invocation& invocation, const Arguments& arguments) {
  v1::MoveGroupRequest request;
  for (const auto& word : arguments.words) {
    const bool first = &word == &arguments.words.front();
    if (word.find('=') != std::string::npos)
      add_target(invocation, arguments, word, request);
    else if (first)
      request.set_group(word);
    else
      throw Failure(ExitCode::usage, fmt::format("'{}' is no target: write AXIS=POSITION", word));
  }
  if (request.targets().empty()) throw Failure(ExitCode::usage, "give targets: AXIS=POSITION ...");
  request.set_arrive_together(arguments.together);
  if (!arguments.max_arrival_error.empty())
    set(*request.mutable_max_arrival_error(),
        parse_duration(arguments.max_arrival_error, "--max-arrival-error"));
  *request.mutable_options() = command_options(arguments);
  return request;
}

std::string after_text(bool given, const google::protobuf::Duration& time) {
  return given ? "+" + milliseconds_text(time) : "-";
}

void print_move(Invocation& invocation, const v1::GroupMove& move) {
  if (move.state() == v1::COMMAND_STATE_ABORTED || move.state() == v1::COMMAND_STATE_ERROR ||
      move.state() == v1::COMMAND_STATE_UNKNOWN)
    invocation.status = ExitCode::ended_otherwise;
  if (invocation.json) return print_line(json(move));
  print_line(fmt::format("{} {}{}{}", move.id(), move.group().empty() ? "" : move.group() + " ",
                         lower_word(v1::CommandState_Name(move.state()), "COMMAND_STATE_"),
                         move.has_cause() ? ": " + describe(move.cause()) : ""));
  Table table({"AXIS", "STATE", "COMMAND", "PREDICTED", "STARTED", "ARRIVED", "BY"}, {3, 4, 5});
  for (const auto& member : move.members())
    table.add({member.command().axis(), command_state(member.command()), member.command().id(),
               milliseconds_text(member.predicted_duration()),
               after_text(member.has_started_after(), member.started_after()),
               after_text(member.has_arrived_after(), member.arrived_after()),
               member.by_sync() ? "SYNC" : member.start_note()});
  table.print(use_colour());
  if (move.has_start_skew()) print_line("start skew " + milliseconds_text(move.start_skew()));
  if (move.arrive_together())
    print_line("predicted arrival error " + milliseconds_text(move.predicted_arrival_error()) +
               (move.has_arrival_error() ? ", seen " + milliseconds_text(move.arrival_error()) : ""));
}

void move(Invocation& invocation, const Arguments& arguments) {
  auto request = request_of(invocation, arguments);
  request.mutable_options()->set_wait_until(arguments.wait ? v1::WAIT_UNTIL_DONE : v1::WAIT_UNTIL_ACCEPTED);
  google::protobuf::Duration tolerance;
  if (!arguments.clock_tolerance.empty())
    set(tolerance, parse_duration(arguments.clock_tolerance, "--clock-tolerance"));
  try {
    if (names_several_machines(invocation, request))
      return move_cell_group(invocation, request, arguments.clock_tolerance.empty() ? nullptr : &tolerance);
    const auto response =
        arguments.wait
            ? invocation.client().call_within(std::chrono::nanoseconds(0), &Stub::MoveGroup, request, "")
            : invocation.client().call(&Stub::MoveGroup, request, std::string_view());
    for (const auto& member : response.move().members()) invocation.started.push_back(member.command());
    print_move(invocation, response.move());
  } catch (const Failure& failure) {
    if (failure.code() != ExitCode::unreachable || failure.nothing_sent()) throw;
    throw failure.saying(fmt::format("{}; if the move may have arrived, repeat it with --request-id {}",
                                     failure.what(), request.options().request_id()));
  }
}

template <class Request, class Response>
void stop(Invocation& invocation, const Arguments& arguments,
          grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  Request request;
  request.set_group(arguments.group);
  for (const auto& axis : arguments.axes) request.add_axes(axis);
  if constexpr (requires { request.set_hold(true); }) request.set_hold(arguments.keep);
  request.set_wait_until(arguments.wait ? v1::WAIT_UNTIL_DONE : v1::WAIT_UNTIL_ACCEPTED);
  // Without a name of its own a hold is released without one, and repetitions are one hold.
  if constexpr (requires { request.set_request_id(""); }) request.set_request_id(arguments.request_id);
  const auto& client = invocation.client();
  const auto response =
      repeat_stop(client, method, request, arguments.group, client.timeout(), arguments.wait);
  if (invocation.json) print_line(json(response));
  for (const auto& result : response.results()) {
    const bool aborted =
        result.has_command() && ended(result.command()) && result.command().state() != v1::COMMAND_STATE_DONE;
    if (result.has_error() || aborted) invocation.status = ExitCode::ended_otherwise;
    if (invocation.json) continue;
    print_line(result.has_error()
                   ? coloured(fmt::format("{}: {}", result.name(), describe(result.error(), result.name())),
                              Colour::red, use_colour())
                   : command_line(result.command(), ""));
  }
}

void add_names(CLI::App& command, Arguments& arguments) {
  command.add_option("GROUP", arguments.group, "Name of a group");
  command.add_option("--axis", arguments.axes, "An axis beside it, or in its place; may be repeated")
      ->type_name("AXIS");
}

void check_names(const Arguments& arguments) {
  if (arguments.group.empty() && arguments.axes.empty())
    throw Failure(ExitCode::usage, "name a group, or axes with --axis");
}

template <class Request, class Response>
void add_stop(CLI::App& group, Invocation& invocation, const char* name, const char* help,
              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  const auto arguments = std::make_shared<Arguments>();
  auto* command = group.add_subcommand(name, help);
  add_names(*command, *arguments);
  if constexpr (requires(Request request) { request.set_hold(true); }) {
    command->add_flag("--hold", arguments->keep, "Stay in Stopping, each, until group release-stop");
    add_hold_id(*command, arguments->request_id);
  }
  add_wait(*command, *arguments);
  command->callback([&invocation, arguments, method] {
    check_names(*arguments);
    stop(invocation, *arguments, method);
  });
}

void release(Invocation& invocation, const Arguments& arguments, const ReleaseArguments& which) {
  v1::GroupReleaseStopRequest request;
  request.set_group(arguments.group);
  for (const auto& axis : arguments.axes) request.add_axes(axis);
  which.fill(request);
  const auto response = invocation.client().call(&Stub::GroupReleaseStop, request, arguments.group);
  if (invocation.json) print_line(json(response));
  for (const auto& result : response.results()) {
    if (result.has_error()) invocation.status = ExitCode::ended_otherwise;
    if (invocation.json) continue;
    print_line(result.has_error()
                   ? coloured(fmt::format("{}: {}", result.name(), describe(result.error(), result.name())),
                              Colour::red, use_colour())
                   : released_line(result.name(), result.holds()));
  }
}

void add_release(CLI::App& group, Invocation& invocation) {
  const auto arguments = std::make_shared<Arguments>();
  const auto which = std::make_shared<ReleaseArguments>();
  auto* command = group.add_subcommand("release-stop", "End a held stop of each axis of a group");
  add_names(*command, *arguments);
  which->add_to(*command);
  command->callback([&invocation, arguments, which] {
    check_names(*arguments);
    release(invocation, *arguments, *which);
  });
}

void add_move(CLI::App& group, Invocation& invocation) {
  const auto arguments = std::make_shared<Arguments>();
  auto* command = group.add_subcommand("move", "Start axes together; all have to rest");
  command
      ->add_option("TARGET", arguments->words,
                   "Name of a group, if any, then AXIS=POSITION, or AXIS=POSITION@VELOCITY, of each")
      ->required();
  command->add_flag("--relative", arguments->relative, "Distances in place of positions");
  command->add_flag("--together", arguments->together,
                    "Slow down the faster ones, so that all arrive together");
  command
      ->add_option("--max-arrival-error", arguments->max_arrival_error,
                   "Refuse where arrivals would lie further apart: 10ms (default: the group's)")
      ->type_name("TIME");
  command
      ->add_option(
          "--clock-tolerance", arguments->clock_tolerance,
          "Over several machines of a cell: refuse where a clock is known less well: 0.5ms (default: 1ms)")
      ->type_name("TIME");
  add_ramps(*command, *arguments);
  add_options(*command, *arguments);
  add_wait(*command, *arguments);
  command->callback([&invocation, arguments] { move(invocation, *arguments); });
}

}  // namespace

void add_group_commands(CLI::App& app, Invocation& invocation) {
  auto* group = app.add_subcommand(
      "group", "Axes that start and stop together: list, move, show, halt, stop, release-stop");
  group->require_subcommand(1);
  group->footer(examples);
  group->add_subcommand("list", "The groups of the configuration")->callback([&invocation] {
    list(invocation);
  });
  add_move(*group, invocation);
  const auto id = std::make_shared<std::string>();
  auto* show = group->add_subcommand("show", "A group move as it stands");
  show->add_option("ID", *id, "As move printed it")->required();
  show->callback([&invocation, id] {
    v1::GetGroupMoveRequest request;
    request.set_id(*id);
    print_move(invocation, invocation.client().call(&Stub::GetGroupMove, request, *id).move());
  });
  add_stop(*group, invocation, "halt", "Decelerate each axis of a group", &Stub::GroupHalt);
  add_stop(*group, invocation, "stop", "Stop each axis of a group; nothing takes over before standstill",
           &Stub::GroupStop);
  add_release(*group, invocation);
}

}  // namespace axisd::axisctl
