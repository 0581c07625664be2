// drive info|save|restore, and the group itself.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <memory>

#include "api/axisctl/drive_commands.hpp"
#include "api/axisctl/drive_view.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/lease_option.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/drive_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::DriveService::Stub;

// Saving and restoring take the drive's own time.
constexpr std::chrono::nanoseconds memory_time = std::chrono::seconds(60);

constexpr const char* examples = R"(
Examples:
  axisctl drive info feeder
  axisctl drive parameters feeder speed --read     all parameters whose name has "speed", with values
  axisctl drive write feeder lock_current=1 current=0x6
  axisctl drive segments feeder --position 1:50mm:20mm/s:100ms --velocity 1:5mm/s
  axisctl drive readdress feeder 7 --confirm feeder --verify 60s)";

void info(Invocation& invocation, const std::string& axis) {
  v1::GetDriveRequest request;
  request.set_axis(axis);
  const auto drive = invocation.client().call(&Stub::GetDrive, request, axis);
  print(invocation.json ? json(drive) + "\n" : drive_details(drive));
}

template <class Request, class Response>
Response confirmed_call(Invocation& invocation, const ConfirmedArguments& arguments,
                        grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  Request request;
  request.set_axis(arguments.axis);
  request.set_confirm(arguments.confirm);
  request.set_lease_token(arguments.lease_token);
  auto& client = invocation.client();  // before its time limit is read
  return client.call_within(std::max(memory_time, invocation.connection.timeout), method, request,
                            arguments.axis);
}

void save(Invocation& invocation, const ConfirmedArguments& arguments) {
  const auto response = confirmed_call(invocation, arguments, &Stub::SaveParameters);
  print_line(invocation.json ? json(response)
                             : fmt::format("{}: all parameters are saved in the drive", arguments.axis));
}

void restore(Invocation& invocation, const ConfirmedArguments& arguments) {
  const auto response = confirmed_call(invocation, arguments, &Stub::RestoreFactory);
  if (invocation.json) return print_line(json(response));
  print_line(fmt::format("{}: the factory settings are back and the position is lost", arguments.axis));
  if (!response.after_power_cycle().empty())
    print_line(fmt::format("after the drive's next power-up: {}", response.after_power_cycle()));
}

}  // namespace

void add_confirmed(CLI::App& command, ConfirmedArguments& arguments) {
  command.add_option("AXIS", arguments.axis, "Name of the axis")->required();
  command
      .add_option("--confirm", arguments.confirm, "The axis's name again: this changes the drive's memory")
      ->type_name("AXIS")
      ->required();
  add_lease(command, arguments.lease_token);
}

void add_drive_commands(CLI::App& app, Invocation& invocation) {
  auto* group = app.add_subcommand("drive", "The drive behind an axis: parameters, segments, address");
  group->require_subcommand(1);
  group->footer(examples);
  auto* info_command = group->add_subcommand("info", "Model, limits, terminals and their functions, alarms");
  const auto axis = std::make_shared<std::string>();
  info_command->add_option("AXIS", *axis, "Name of the axis")->required();
  info_command->callback([&invocation, axis] { info(invocation, *axis); });

  add_parameter_commands(*group, invocation);

  const auto add = [&](const char* name, const char* help,
                       void (*action)(Invocation&, const ConfirmedArguments&)) {
    auto* command = group->add_subcommand(name, help);
    const auto arguments = std::make_shared<ConfirmedArguments>();
    add_confirmed(*command, *arguments);
    command->callback([&invocation, arguments, action] { action(invocation, *arguments); });
  };
  add("save", "Save all parameters in the drive's EEPROM; at standstill, power stage off", save);
  add("restore", "Restore the factory settings, address and serial settings included", restore);

  add_segment_command(*group, invocation);
  add_serial_commands(*group, invocation);
}

}  // namespace axisd::axisctl
