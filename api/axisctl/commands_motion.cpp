// enable, disable, home, move, velocity, reset, set-position.
#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <type_traits>

#include "api/axisctl/across.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/motion_arguments.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/quantity.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::AxisService::Stub;
using Arguments = std::shared_ptr<MotionArguments>;

void finish(Invocation& invocation, const MotionArguments& arguments,
            const std::vector<v1::Command>& commands, const v1::AxisState& before) {
  invocation.status = report(invocation, commands, arguments.wait,
                             {.unit = before.unit(),
                              .start = before.position(),
                              .halt_on_interrupt = arguments.halt_on_interrupt,
                              .several = arguments.axes.size() > 1});
}

void move(Invocation& invocation, const MotionArguments& arguments, bool relative) {
  const auto before = invocation.state(arguments.axis());
  const double value = parse_value(arguments.value, before.unit(), relative ? "distance" : "position");
  const auto request_move = [&](auto request, auto method, auto&& set_value) {
    request.set_axis(arguments.axis());
    set_value(request);
    set_profile(request, arguments, before.unit());
    *request.mutable_options() = command_options(arguments);
    finish(invocation, arguments, {send(invocation, method, request)}, before);
  };
  if (relative)
    request_move(v1::MoveRelativeRequest(), &Stub::MoveRelative, [&](auto& r) { r.set_distance(value); });
  else
    request_move(v1::MoveAbsoluteRequest(), &Stub::MoveAbsolute, [&](auto& r) { r.set_position(value); });
}

void velocity(Invocation& invocation, const MotionArguments& arguments) {
  const auto before = invocation.state(arguments.axis());
  v1::MoveVelocityRequest request;
  request.set_axis(arguments.axis());
  request.set_velocity(parse_value(arguments.value, before.unit() + "/s", "velocity"));
  if (!arguments.hold.empty()) set(*request.mutable_hold(), parse_duration(arguments.hold, "--hold"));
  set_ramps(request, arguments);
  *request.mutable_options() = command_options(arguments);
  finish(invocation, arguments, {send(invocation, &Stub::MoveVelocity, request)}, before);
}

void set_position(Invocation& invocation, const MotionArguments& arguments) {
  const auto before = invocation.state(arguments.axis());
  v1::SetPositionRequest request;
  request.set_axis(arguments.axis());
  request.set_position(parse_value(arguments.value, before.unit(), "position"));
  *request.mutable_options() = command_options(arguments);
  finish(invocation, arguments, {send(invocation, &Stub::SetPosition, request)}, before);
}

template <class Request, class Response>
v1::Command send_simple(Invocation& invocation, const MotionArguments& arguments, const std::string& axis,
                        grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                        Lane lane = Lane::ordinary) {
  Request request;
  request.set_axis(axis);
  *request.mutable_options() = command_options(arguments);
  return send(invocation, method, request, lane);
}

void check_request_id(const MotionArguments& arguments) {
  if (!arguments.request_id.empty() && arguments.axes.size() > 1)
    throw Failure(ExitCode::usage, "--request-id belongs to one command: name one axis with it");
}

/// Commands that need nothing but the axis: none is sent unless all axes are known, and all are sent before
/// the first is followed.
template <class Request, class Response>
void simple(Invocation& invocation, const MotionArguments& arguments,
            grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  check_request_id(arguments);
  v1::AxisState before;
  for (const auto& axis : arguments.axes) before = invocation.state(axis);
  std::vector<v1::Command> commands;
  try {
    for (const auto& axis : arguments.axes)
      commands.push_back(send_simple(invocation, arguments, axis, method));
  } catch (const Failure&) {
    report(invocation, commands, false,
           {.unit = before.unit(),
            .start = {},
            .several = arguments.axes.size() > 1});  // these were accepted, and go on
    throw;
  }
  finish(invocation, arguments, commands, before);
}

/// A stop, too: asks nothing before, and leaves none out because of another one's trouble.
template <class Request, class Response>
void disable(Invocation& invocation, const MotionArguments& arguments,
             grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  check_request_id(arguments);
  std::vector<std::optional<v1::Command>> answers(arguments.axes.size());
  std::vector<std::optional<Failure>> refusals(arguments.axes.size());
  invocation.client();  // made by one thread
  for_each_machine(arguments.axes, [&](const std::vector<std::size_t>& indices) {
    for (const auto i : indices) try {
        answers[i] = send_simple(invocation, arguments, arguments.axes[i], method, Lane::stop);
      } catch (const Failure& failure) {
        refusals[i] = failure;
      }
  });
  std::vector<v1::Command> commands;
  auto worst = ExitCode::ok;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (answers[i]) commands.push_back(*answers[i]);
    if (!refusals[i]) continue;
    complain(*refusals[i], invocation.json);
    worst = refusals[i]->code();
  }
  invocation.status = report(invocation, commands, arguments.wait,
                             {.unit = {}, .start = {}, .several = arguments.axes.size() > 1});
  if (worst != ExitCode::ok) invocation.status = worst;
}

CLI::App* add(CLI::App& app, const std::string& name, const std::string& help, const Arguments& arguments) {
  auto* command = app.add_subcommand(name, help);
  add_options(*command, *arguments);
  add_wait(*command, *arguments);
  return command;
}

void add_halt_on_interrupt(CLI::App& command, MotionArguments& arguments) {
  command.add_flag("--halt-on-interrupt", arguments.halt_on_interrupt,
                   "With --wait: Ctrl-C halts the axis (without it the command goes on)");
  command.add_flag("--buffered", arguments.buffered,
                   "Start when the present command is done instead of ending it");
}

template <class Request, class Response>
void add_simple(CLI::App& app, Invocation& invocation, const std::string& name, const std::string& help,
                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  const auto arguments = std::make_shared<MotionArguments>();
  auto* command = add(app, name, help, arguments);
  add_several_axes(*command, *arguments);
  command->get_option("AXIS")->required();
  if constexpr (!std::is_same_v<Request, v1::DisableRequest>)
    command->footer(
        "\nSeveral axes are asked in this order, up to the first that is refused; what was accepted goes "
        "on.");
  if (name == "home") add_halt_on_interrupt(*command, *arguments);
  command->callback([&invocation, arguments, method] {
    if constexpr (std::is_same_v<Request, v1::DisableRequest>)
      disable(invocation, *arguments, method);
    else
      simple(invocation, *arguments, method);
  });
}

void add_move(CLI::App& app, Invocation& invocation) {
  const auto arguments = std::make_shared<MotionArguments>();
  const auto relative = std::make_shared<bool>(false);
  auto* command =
      add(app, "move", "Move to a position, or by a distance: axisctl move feeder 120mm --wait", arguments);
  add_axis(*command, *arguments);
  command
      ->add_option("VALUE", arguments->value,
                   "Position or distance, with or without the axis's unit: 120mm, -10")
      ->required();
  command->add_flag("--relative", *relative, "VALUE is a distance");
  command->add_option("--velocity", arguments->velocity, "Per second: 50mm/s (default: the axis's limit)")
      ->type_name("VALUE");
  add_ramps(*command, *arguments);
  add_halt_on_interrupt(*command, *arguments);
  command->callback([&invocation, arguments, relative] { move(invocation, *arguments, *relative); });
}

void add_velocity(CLI::App& app, Invocation& invocation) {
  const auto arguments = std::make_shared<MotionArguments>();
  auto* command = add(app, "velocity", "Move at a velocity, endlessly or towards the soft limit", arguments);
  add_axis(*command, *arguments);
  command->add_option("VALUE", arguments->value, "Signed, per second: 20mm/s, -20")->required();
  command->add_option("--hold", arguments->hold, "Halt unless the call is repeated within this time: 500ms")
      ->type_name("TIME");
  add_ramps(*command, *arguments);
  add_halt_on_interrupt(*command, *arguments);
  command->callback([&invocation, arguments] { velocity(invocation, *arguments); });
}

}  // namespace

void add_motion_commands(CLI::App& app, Invocation& invocation) {
  add_simple(app, invocation, "enable", "Switch the power stage on; never moves", &Stub::Enable);
  add_simple(app, invocation, "disable", "Stop, wait for standstill, switch the power stage off",
             &Stub::Disable);
  add_simple(app, invocation, "home", "Search the home position as configured", &Stub::Home);
  add_move(app, invocation);
  add_velocity(app, invocation);
  add_simple(app, invocation, "reset", "Leave ErrorStop if the cause is gone; never moves", &Stub::Reset);
  const auto arguments = std::make_shared<MotionArguments>();
  auto* command = add(app, "set-position", "Declare the present position; at standstill only", arguments);
  add_axis(*command, *arguments);
  command->add_option("VALUE", arguments->value, "What the present position shall be: 0, 12.5mm")->required();
  command->callback([&invocation, arguments] { set_position(invocation, *arguments); });
}

}  // namespace axisd::axisctl
