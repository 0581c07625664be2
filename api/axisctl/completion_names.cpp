// Names for completion, asked of the daemon that the command line names.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iterator>

#include "api/axisctl/completion.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "axisd/v1/group_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

constexpr const char* patience = "3s";

void add_axes(const Client& client, const std::string& behind, std::vector<Candidate>& names) {
  const auto response =
      client.call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest(), std::string_view());
  for (const auto& axis : response.axes()) names.push_back({axis.axis() + behind, ""});
}

/// Of a whole cell: its entrance knows them, and no machine is asked.
void add_of_cell(const Client& client, const Place& place, std::vector<Candidate>& names) {
  const auto response = client.call(&cell::v1::CellService::Stub::ListMachines,
                                    cell::v1::ListMachinesRequest(), std::string_view());
  for (const auto& machine : response.machines()) {
    if (place.names == Names::machines) names.push_back({machine.name(), ""});
    if (place.names == Names::machines) continue;
    for (const auto& axis : machine.axes())
      names.push_back({fmt::format("{}/{}{}", machine.name(), axis, place.behind), ""});
  }
}

void add_buses(const Client& client, std::vector<Candidate>& names) {
  const auto response =
      client.call(&v1::BusService::Stub::ListBuses, v1::ListBusesRequest(), std::string_view());
  for (const auto& bus : response.buses()) names.push_back({bus.name(), ""});
}

void add_groups(const Client& client, std::vector<Candidate>& names) {
  const auto response =
      client.call(&v1::GroupService::Stub::ListGroups, v1::ListGroupsRequest(), std::string_view());
  for (const auto& group : response.groups())
    names.push_back({group.name(), fmt::format("{}", fmt::join(group.axes(), ", "))});
}

void add_devices(const Client& client, const Place& place, std::vector<Candidate>& names) {
  const auto response =
      client.call(&v1::BusService::Stub::ListDevices, v1::ListDevicesRequest(), std::string_view());
  for (const auto& device : response.devices()) {
    if (place.names == Names::devices) names.push_back({device.name(), ""});
    if (place.names == Names::device_values && device.name() == place.subject)
      for (const auto& value : device.values()) names.push_back({value.name(), ""});
  }
}

void add_parameters(const Client& client, const Place& place, std::vector<Candidate>& names) {
  v1::ListParametersRequest request;
  request.set_axis(place.subject);
  const auto response = client.call(&v1::DriveService::Stub::ListParameters, request, place.subject);
  for (const auto& parameter : response.parameters())
    names.push_back({parameter.name() + place.behind, parameter.description()});
}

/// What is typed names the machine, or nothing does: then only axes and machines are known.
void add_names(const Client& client, const Place& place, std::vector<Candidate>& names);

void add_names_in_cell(const Client& client, const Place& place, std::vector<Candidate>& names) {
  const bool of_machines = place.names == Names::machines;
  if (!of_machines && !client.connection().machine.empty()) return add_names(client, place, names);
  const bool of_subject = place.names == Names::parameters || place.names == Names::device_values;
  if (const std::string machine(machine_in(of_subject ? place.subject : place.typed));
      !of_machines && !machine.empty())
    return add_names(client.at(machine), place, names);
  if (of_machines || place.names == Names::axes || place.names == Names::targets ||
      place.names == Names::axes_and_groups)
    add_of_cell(client, place, names);
}

void add_names(const Client& client, const Place& place, std::vector<Candidate>& names) {
  switch (place.names) {
    case Names::machines:
      return;
    case Names::none:
    case Names::files:
      return;
    case Names::axes_and_groups:
    case Names::targets:
      add_groups(client, names);
      [[fallthrough]];
    case Names::axes:
      return add_axes(client, place.behind, names);
    case Names::buses:
      return add_buses(client, names);
    case Names::groups:
      return add_groups(client, names);
    case Names::devices:
    case Names::device_values:
      return add_devices(client, place, names);
    case Names::parameters:
      return add_parameters(client, place, names);
  }
}

}  // namespace

std::optional<std::vector<Candidate>> candidates(const Place& place) {
  if (place.names == Names::files) return std::nullopt;
  auto found = place.words;
  if (place.names != Names::none) {
    std::vector<Candidate> names;
    try {
      Invocation invocation;
      const auto app = make_app(invocation);  // reads the environment, too
      app->require_subcommand(0);
      execute(*app, place.connection);
      invocation.timeout = patience;
      const auto& client = invocation.client();
      if (client.connection().through_entrance())
        add_names_in_cell(client, place, names);
      else
        add_names(client, place, names);
    } catch (const std::exception&) {
      names.clear();  // half a list would look like a whole one
    }
    std::ranges::move(names, std::back_inserter(found));
  }
  std::erase_if(found, [&](const Candidate& one) { return !one.text.starts_with(place.typed); });
  for (auto& one : found) one.text.insert(0, place.before);
  return found;
}

void complete(const std::vector<std::string>& words) {
  Invocation invocation;
  const auto found = candidates(place_of(*make_app(invocation), words));
  if (!found) return print_line(":files");
  for (const auto& one : *found)
    print_line(one.description.empty() ? one.text : fmt::format("{}\t{}", one.text, one.description));
}

}  // namespace axisd::axisctl
