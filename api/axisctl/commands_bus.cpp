// bus read|write, device list|write: nodes that are not axes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "api/axisctl/bus_commands.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::BusService::Stub;

struct Arguments {
  std::string bus, node, address, count = "1";
  std::vector<std::string> values;
};

std::uint32_t word(const std::string& text, std::string_view what, std::int64_t minimum = 0) {
  const auto value = parse_integer(text, what);
  if (value < minimum || value > 65535)
    throw Failure(ExitCode::usage,
                  fmt::format("{}: {} is out of range; permitted: {} to 65535", what, value, minimum));
  return static_cast<std::uint32_t>(value < 0 ? value + 65536 : value);
}

v1::TransactRequest request_of(const Arguments& arguments) {
  v1::TransactRequest request;
  request.set_bus(arguments.bus);
  request.set_node(word(arguments.node, "NODE"));
  request.set_address(word(arguments.address, "ADDRESS"));
  return request;
}

void read(Invocation& invocation, const Arguments& arguments) {
  auto request = request_of(arguments);
  request.set_read(word(arguments.count, "COUNT"));
  const auto response = invocation.client().call(&Stub::Transact, request, std::string_view());
  if (invocation.json) return print_line(json(response));
  Table table({"ADDRESS", "HEX", "UNSIGNED", "SIGNED"}, {2, 3});
  auto address = request.address();
  for (const auto value : response.values())
    table.add({fmt::format("0x{:04X}", address++), fmt::format("0x{:04X}", value), std::to_string(value),
               std::to_string(static_cast<std::int16_t>(value))});
  table.print(use_colour());
}

void write(Invocation& invocation, const Arguments& arguments) {
  auto request = request_of(arguments);
  for (const auto& text : arguments.values) request.mutable_write()->add_values(word(text, "VALUE", -32768));
  const auto response = invocation.client().call(&Stub::Transact, request, std::string_view());
  const auto count = arguments.values.size();
  print_line(invocation.json ? json(response)
                             : fmt::format("{} node {}: {} register{} written", arguments.bus, request.node(),
                                           count, count == 1 ? "" : "s"));
}

Cell device_link(const v1::Device& device) {
  const auto text = lower_word(v1::LinkState_Name(device.link()), "LINK_STATE_");
  if (!device.has_error()) return text;
  return {fmt::format("{}: {}", text, describe(device.error())), Colour::red};
}

void list(Invocation& invocation) {
  const auto response =
      invocation.client().call(&Stub::ListDevices, v1::ListDevicesRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  Table table({"DEVICE", "BUS", "NODE", "REGISTER", "VALUE", "UNIT", "ACCESS", "LINK"}, {2, 4});
  for (const auto& device : response.devices())
    for (const auto& value : device.values())
      table.add({device.name(), device.bus(), std::to_string(device.node()), value.name(),
                 value.has_value() ? number(value.value()) : "", value.unit(),
                 value.writable() ? "read/write" : "read", device_link(device)});
  table.print(use_colour());
}

struct DeviceArguments {
  std::string device, name, value;
};

void write_device(Invocation& invocation, const DeviceArguments& arguments) {
  std::string unit;
  for (const auto& device :
       invocation.client().call(&Stub::ListDevices, v1::ListDevicesRequest(), std::string_view()).devices())
    for (const auto& value : device.values())
      if (device.name() == arguments.device && value.name() == arguments.name) unit = value.unit();
  v1::WriteDeviceRequest request;
  request.set_device(arguments.device);
  request.set_register_(arguments.name);
  request.set_value(parse_value(arguments.value, unit, "VALUE"));
  const auto response = invocation.client().call(&Stub::WriteDevice, request, arguments.device);
  print_line(invocation.json ? json(response)
                             : fmt::format("{} {} = {}", arguments.device, arguments.name,
                                           with_unit(response.value(), unit)));
}

void add_exchanges(CLI::App& group, Invocation& invocation) {
  const auto add = [&](const char* name, const char* help, void (*action)(Invocation&, const Arguments&)) {
    auto* command = group.add_subcommand(name, help);
    const auto arguments = std::make_shared<Arguments>();
    command->add_option("BUS", arguments->bus, "Name of the bus")->required();
    command->add_option("NODE", arguments->node, "Address of the node")->required();
    command->add_option("ADDRESS", arguments->address, "First register: 16 or 0x10")->required();
    command->callback([&invocation, arguments, action] { action(invocation, *arguments); });
    return std::pair(command, arguments);
  };
  const auto [read_command, wanted] = add("read", "Read holding registers of any node", read);
  read_command->add_option("COUNT", wanted->count, "How many registers")->capture_default_str();
  const auto [write_command, written] =
      add("write", "Write holding registers of a node that no axis owns", write);
  write_command->add_option("VALUE", written->values, "Values, -32768 to 65535 or 0x")->required();
}

}  // namespace

void add_bus_commands(CLI::App& app, Invocation& invocation) {
  auto* bus = app.add_subcommand("bus", "What is on a bus: scan it, read and write single registers");
  bus->require_subcommand(1);
  bus->footer(R"(
Examples:
  axisctl bus scan line-a --nodes 1-32
  axisctl bus read line-a 9 0x0000 4
  axisctl bus write line-a 40 16 -5 0x00FF)");
  add_scan_command(*bus, invocation);
  add_exchanges(*bus, invocation);

  auto* device = app.add_subcommand("device", "Nodes that are not axes ('devices:' of the configuration)");
  device->require_subcommand(1);
  device->footer("\nExample: axisctl device write valves pressure 2.5bar");
  device->add_subcommand("list", "All devices with their registers")->callback([&invocation] {
    list(invocation);
  });
  const auto arguments = std::make_shared<DeviceArguments>();
  auto* write_command = device->add_subcommand("write", "Write one named register");
  write_command->add_option("DEVICE", arguments->device, "Name of the device")->required();
  write_command->add_option("REGISTER", arguments->name, "Name of the register")->required();
  write_command->add_option("VALUE", arguments->value, "With or without the register's unit")->required();
  write_command->callback([&invocation, arguments] { write_device(invocation, *arguments); });
}

}  // namespace axisd::axisctl
