// sim: what hands, supplies and cables do to simulated drives.
#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>

#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/simulation_client.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

struct Arguments {
  std::string name;             ///< of an axis or bus
  std::string terminal, value;  ///< as the subcommand has them
};

SimulationClient connected(Invocation& invocation) {
  const auto& client = invocation.client();
  const auto info = client.call(&v1::SystemService::Stub::GetInfo, v1::GetInfoRequest(), std::string_view());
  return {info.instance_id(), client.timeout()};
}

void print_done(const Invocation& invocation, const std::string& name, const std::string& command,
                const std::string& reply) {
  if (!invocation.json) return print_line(fmt::format("{}: {}", name, reply.empty() ? command : reply));
  google::protobuf::Struct line;
  auto& fields = *line.mutable_fields();
  fields["name"].set_string_value(name);
  fields["command"].set_string_value(command);
  fields["reply"].set_string_value(reply);
  print_line(json(line));
}

/// `kind`: "axis" or "bus". What they reply.
std::string ask(const SimulationClient& drives, std::string_view kind, const std::string& name,
                std::string_view command) {
  try {
    return drives.ask(fmt::format("{} {} {}", kind, without_machine(name), command));
  } catch (const Failure& failure) {
    throw failure.saying(fmt::format("{}: {}", name, failure.what()));
  }
}

void tell(Invocation& invocation, std::string_view kind, const std::string& name,
          const std::string& command) {
  print_done(invocation, name, command, ask(connected(invocation), kind, name, command));
}

void power(Invocation& invocation, const Arguments& arguments) {
  constexpr std::chrono::milliseconds off_time(1000);  // longer than any capacitor of a drive holds
  if (arguments.value != "cycle") return tell(invocation, "axis", arguments.name, "power " + arguments.value);
  const auto drives = connected(invocation);
  ask(drives, "axis", arguments.name, "power off");
  {
    const Interrupt interrupt([] {});
    static_cast<void>(interrupt.wait_for(off_time));
  }
  print_done(invocation, arguments.name, "power cycle", ask(drives, "axis", arguments.name, "power on"));
}

void push(Invocation& invocation, const Arguments& arguments) {
  const auto unit = invocation.state(arguments.name).unit();
  tell(invocation, "axis", arguments.name,
       fmt::format("push {}", parse_value(arguments.value, unit, "DISTANCE")));
}

using Action = void (*)(Invocation&, const Arguments&);

/// Adds `name` AXIS; what else it takes is added to what it returns.
std::pair<CLI::App*, std::shared_ptr<Arguments>> add(CLI::App& group, Invocation& invocation,
                                                     const std::string& name, const std::string& help,
                                                     Action action) {
  auto* command = group.add_subcommand(name, help);
  auto arguments = std::make_shared<Arguments>();
  command->add_option("AXIS", arguments->name, "Name of the axis")->required();
  command->callback([&invocation, arguments, action] { action(invocation, *arguments); });
  return {command, std::move(arguments)};
}

void add_states(CLI::App& command, Arguments& arguments, const std::vector<std::string>& states) {
  command.add_option("STATE", arguments.value, "What to do")->required()->check(CLI::IsMember(states));
}

void add_bus(CLI::App& group, Invocation& invocation, const std::string& name, const std::string& help) {
  auto* command = group.add_subcommand(name, help);
  const auto bus = std::make_shared<std::string>();
  command->add_option("BUS", *bus, "Name of the bus")->required();
  command->callback([&invocation, bus, name] { tell(invocation, "bus", *bus, name); });
}

void add_hands(CLI::App& group, Invocation& invocation) {
  const auto [input, of_input] =
      add(group, invocation, "input", "Actuate an input by hand, whatever its active level",
          [](Invocation& of, const Arguments& given) {
            tell(of, "axis", given.name, fmt::format("input {} {}", given.terminal, given.value));
          });
  input->add_option("TERMINAL", of_input->terminal, "Name of the terminal, such as X0")->required();
  add_states(*input, *of_input, {"on", "off", "auto"});
  input->footer("\nauto: as the switches of the simulated machine have it.");

  const auto [block, of_block] = add(
      group, invocation, "block", "Hold the shaft, so that it cannot turn",
      [](Invocation& of, const Arguments& given) { tell(of, "axis", given.name, "block " + given.value); });
  add_states(*block, *of_block, {"on", "off"});

  const auto [pushed, of_push] = add(group, invocation, "push", "Turn a shaft that is released", push);
  pushed->add_option("DISTANCE", of_push->value, "How far, in the unit of the axis: 5mm, -5")->required();
}

void add_drive_faults(CLI::App& group, Invocation& invocation) {
  const auto [supply, of_power] =
      add(group, invocation, "power", "Switch the drive's supply; cycle: off, and on after a second", power);
  add_states(*supply, *of_power, {"on", "off", "cycle"});

  const auto [alarm, of_alarm] = add(
      group, invocation, "alarm", "Raise an alarm of the drive; 0: its cause is gone",
      [](Invocation& of, const Arguments& given) { tell(of, "axis", given.name, "alarm " + given.value); });
  alarm->add_option("CODE", of_alarm->value, "As 'axisctl drive info' lists them")->required();

  const auto [lose, of_lose] = add(
      group, invocation, "lose", "Lose replies of the drive: it does what it was asked for, unheard",
      [](Invocation& of, const Arguments& given) { tell(of, "axis", given.name, "lose " + given.value); });
  lose->add_option("COUNT", of_lose->value, "How many")->required();

  add(group, invocation, "show", "Where the load really is, and how often it was started",
      [](Invocation& of, const Arguments& given) { tell(of, "axis", given.name, "show"); });
}

}  // namespace

void add_sim_commands(CLI::App& app, Invocation& invocation) {
  auto* group = app.add_subcommand(
      "sim", "What hands, supplies and cables do to simulated drives: inputs, alarms, power, lost frames");
  group->require_subcommand(1);
  group->footer(R"(
Drives on a bus with port: sim or interface: sim take this from the daemon's own computer, of its own user or root.

Examples:
  axisctl sim input feeder X1 on       # a hand on the limit switch
  axisctl sim power feeder cycle
  axisctl sim alarm feeder 2           # and 0 before axisctl reset feeder
  axisctl sim lose feeder 3
  axisctl sim cut line-a               # the cable; axisctl sim join line-a)");
  add_hands(*group, invocation);
  add_drive_faults(*group, invocation);
  add_bus(*group, invocation, "cut", "Cut the cable of a bus");
  add_bus(*group, invocation, "join", "Mend it");
  add_bus(*group, invocation, "clear", "Take back what was to be lost");
}

}  // namespace axisd::axisctl
