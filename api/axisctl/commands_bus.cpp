// bus list|status|read|write|transact, device list|write: buses, and nodes that are not axes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>

#include "api/axisctl/bus_commands.hpp"
#include "api/axisctl/bus_view.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "config/quantity.hpp"

namespace axisd::axisctl {
namespace {

using Stub = v1::BusService::Stub;

struct Arguments {
  std::string bus, node, operation, address, type, count = "1";
  std::vector<std::string> values;
};

std::uint32_t word(const std::string& text, std::string_view what, std::int64_t minimum = 0) {
  const auto value = parse_integer(text, what);
  if (value < minimum || value > 65535)
    throw Failure(ExitCode::usage,
                  fmt::format("{}: {} is out of range; permitted: {} to 65535", what, value, minimum));
  return static_cast<std::uint32_t>(value < 0 ? value + 65536 : value);
}

/// "6041h:00", or "6041h", as manuals write it: then the node is one of a CAN network.
bool is_object(const std::string& address) {
  return address.find("h:") != std::string::npos || address.ends_with('h');
}

v1::TransactRequest request_of(const Arguments& arguments) {
  v1::TransactRequest request;
  request.set_bus(arguments.bus);
  request.set_node(word(arguments.node, "NODE"));
  if (!is_object(arguments.address)) {
    request.set_address(word(arguments.address, "ADDRESS"));
    return request;
  }
  const bool whole = arguments.address.find(':') != std::string::npos;
  const auto object = config::parse_object_address(whole ? arguments.address : arguments.address + ":00");
  if (!object)
    throw Failure(ExitCode::usage,
                  fmt::format("ADDRESS: {}; {}", object.error().message, object.error().suggestion));
  request.set_address(*object);
  return request;
}

struct TypeName {
  std::string_view name;
  v1::ParameterType type;
};
constexpr TypeName types[] = {{"u8", v1::PARAMETER_TYPE_UINT8},   {"i8", v1::PARAMETER_TYPE_INT8},
                              {"u16", v1::PARAMETER_TYPE_UINT16}, {"i16", v1::PARAMETER_TYPE_INT16},
                              {"u32", v1::PARAMETER_TYPE_UINT32}, {"i32", v1::PARAMETER_TYPE_INT32}};

/// Unspecified without `text`.
v1::ParameterType type_of(const std::string& text) {
  if (text.empty()) return v1::PARAMETER_TYPE_UNSPECIFIED;
  const auto found = std::ranges::find(types, text, &TypeName::name);
  if (found == std::end(types))
    throw Failure(ExitCode::usage,
                  fmt::format("--type: '{}' is none; permitted: u8, i8, u16, i16, u32, i32", text));
  return found->type;
}

void read_object(Invocation& invocation, const Arguments& arguments) {
  auto request = request_of(arguments);
  request.mutable_read_object()->set_type(type_of(arguments.type));
  const auto response = invocation.client().call(&Stub::Transact, request, std::string_view());
  if (invocation.json) return print_line(json(response));
  object_table(request.address(), response).print(use_colour());
}

void write_object(Invocation& invocation, const Arguments& arguments) {
  if (arguments.address.find(':') == std::string::npos)
    throw Failure(ExitCode::usage,
                  fmt::format("ADDRESS: give the sub-index to write, such as {}:00", arguments.address));
  auto request = request_of(arguments);
  if (arguments.type.empty())
    throw Failure(ExitCode::usage,
                  "give --type: it must be the object's own, for its size; such as --type u16");
  if (arguments.values.size() != 1) throw Failure(ExitCode::usage, "an object takes one VALUE");
  auto& written = *request.mutable_write_object()->mutable_number();
  written.set_type(type_of(arguments.type));
  written.set_value(parse_integer(arguments.values.front(), "VALUE"));
  const auto response = invocation.client().call(&Stub::Transact, request, std::string_view());
  print_line(invocation.json ? json(response)
                             : fmt::format("{} node {}: {} written", arguments.bus, request.node(),
                                           address_text(request.address())));
}

void read(Invocation& invocation, const Arguments& arguments) {
  if (is_object(arguments.address)) return read_object(invocation, arguments);
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
  if (is_object(arguments.address)) return write_object(invocation, arguments);
  auto request = request_of(arguments);
  for (const auto& text : arguments.values) request.mutable_write()->add_values(word(text, "VALUE", -32768));
  const auto response = invocation.client().call(&Stub::Transact, request, std::string_view());
  const auto count = arguments.values.size();
  print_line(invocation.json ? json(response)
                             : fmt::format("{} node {}: {} register{} written", arguments.bus, request.node(),
                                           count, count == 1 ? "" : "s"));
}

/// bus transact: both, as one command.
void transact(Invocation& invocation, const Arguments& arguments) {
  if (arguments.operation == "write") {
    if (arguments.values.empty()) throw Failure(ExitCode::usage, "give the VALUE to write");
    return write(invocation, arguments);
  }
  auto reading = arguments;
  if (arguments.values.size() > 1) throw Failure(ExitCode::usage, "a read takes one COUNT at most");
  if (!arguments.values.empty()) reading.count = arguments.values.front();
  read(invocation, reading);
}

void status(Invocation& invocation, const std::string& name) {
  const auto response =
      invocation.client().call(&Stub::ListBuses, v1::ListBusesRequest(), std::string_view());
  v1::ListBusesResponse shown;
  for (const auto& bus : response.buses())
    if (name.empty() || bus.name() == name) *shown.add_buses() = bus;
  if (shown.buses().empty() && !name.empty()) throw no_such_bus(name, response);
  if (invocation.json) return print_line(json(shown));
  std::string text;
  for (const auto& bus : shown.buses()) text += (text.empty() ? "" : "\n") + bus_details(bus);
  print(text);
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
  Table table({"DEVICE", "BUS", "NODE", "NAME", "VALUE", "UNIT", "ACCESS", "LINK"}, {2, 4});
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

constexpr const char* address_help = "First register: 16 or 0x10; or object: 6041h:00";

void add_type(CLI::App& command, Arguments& arguments, const char* help) {
  command.add_option("--type", arguments.type, help)->type_name("TYPE");
}

void add_exchanges(CLI::App& group, Invocation& invocation) {
  const auto add = [&](const char* name, const char* help, void (*action)(Invocation&, const Arguments&)) {
    auto* command = group.add_subcommand(name, help);
    const auto arguments = std::make_shared<Arguments>();
    command->add_option("BUS", arguments->bus, "Name of the bus")->required();
    command->add_option("NODE", arguments->node, "Address or node-ID")->required();
    command->add_option("ADDRESS", arguments->address, address_help)->required();
    command->callback([&invocation, arguments, action] { action(invocation, *arguments); });
    return std::pair(command, arguments);
  };
  const auto [read_command, wanted] = add("read", "Read holding registers or an object of any node", read);
  read_command->add_option("COUNT", wanted->count, "How many registers")->capture_default_str();
  add_type(*read_command, *wanted, "How an object is read: u8, i8, u16, i16, u32 or i32");
  const auto [write_command, written] =
      add("write", "Write holding registers or an object of a node that no axis owns", write);
  write_command
      ->add_option("VALUE", written->values, "Values of registers, -32768 to 65535 or 0x; or of the object")
      ->required();
  add_type(*write_command, *written, "Of an object: u8, i8, u16, i16, u32 or i32; it decides the size");

  auto* command = group.add_subcommand("transact", "One exchange: read or write registers, or an object");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("BUS", arguments->bus, "Name of the bus")->required();
  command->add_option("NODE", arguments->node, "Address or node-ID")->required();
  command->add_option("OPERATION", arguments->operation, "read or write")
      ->required()
      ->check(CLI::IsMember({"read", "write"}));
  command->add_option("ADDRESS", arguments->address, address_help)->required();
  command->add_option("VALUE", arguments->values, "What is written; of a read of registers: how many");
  add_type(*command, *arguments, "Of an object: u8, i8, u16, i16, u32 or i32");
  command->callback([&invocation, arguments] { transact(invocation, *arguments); });
}

}  // namespace

void list_buses(Invocation& invocation) {
  const auto response =
      invocation.client().call(&Stub::ListBuses, v1::ListBusesRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  const bool networks = std::ranges::any_of(response.buses(), is_network);
  const bool lines = !std::ranges::all_of(response.buses(), is_network);
  if (lines || !networks) line_table(response).print(use_colour());
  if (lines && networks) print("\n");
  if (networks) network_table(response).print(use_colour());
}

void add_bus_commands(CLI::App& app, Invocation& invocation) {
  auto* bus = app.add_subcommand(
      "bus", "The buses, and what is on them: scan, read and write single registers or objects");
  bus->require_subcommand(1);
  bus->footer(R"(
Examples:
  axisctl bus scan line-a --nodes 1-32
  axisctl bus read line-a 9 0x0000 4
  axisctl bus write line-a 40 16 -5 0x00FF
  axisctl bus status can0
  axisctl bus statistics line-a
  axisctl bus transact can0 5 read 6041h:00
  axisctl bus transact can0 50 write 6200h:01 3 --type u8)");
  bus->add_subcommand("list", "All buses, a table for each kind")->callback([&invocation] {
    list_buses(invocation);
  });
  auto* status_command = bus->add_subcommand("status", "All that is known of a bus, or of every bus");
  const auto name = std::make_shared<std::string>();
  status_command->add_option("BUS", *name, "Name of the bus");
  status_command->callback([&invocation, name] { status(invocation, *name); });
  add_scan_command(*bus, invocation);
  add_watch_commands(*bus, invocation);
  add_exchanges(*bus, invocation);

  auto* device = app.add_subcommand("device", "Nodes that are not axes ('devices:' of the configuration)");
  device->require_subcommand(1);
  device->footer("\nExample: axisctl device write valves pressure 2.5bar");
  device->add_subcommand("list", "All devices with their registers or objects")->callback([&invocation] {
    list(invocation);
  });
  const auto arguments = std::make_shared<DeviceArguments>();
  auto* write_command = device->add_subcommand("write", "Write one named register or object");
  write_command->add_option("DEVICE", arguments->device, "Name of the device")->required();
  write_command->add_option("NAME", arguments->name, "Name of the register or object")->required();
  write_command->add_option("VALUE", arguments->value, "With or without its unit")->required();
  write_command->callback([&invocation, arguments] { write_device(invocation, *arguments); });
}

}  // namespace axisd::axisctl
