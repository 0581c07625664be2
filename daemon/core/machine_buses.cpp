#include "daemon/core/machine_buses.hpp"

#include <algorithm>

namespace axisd::core {

namespace {

const auto name_of = [](const auto& bus) -> const std::string& { return bus->name(); };

}  // namespace

Bus* MachineBuses::find(std::string_view bus) const {
  const auto found = std::ranges::find(all, bus, name_of);
  return found == all.end() ? nullptr : *found;
}

modbus_rtu::RtuBus* MachineBuses::find_line(std::string_view bus) const {
  const auto found = std::ranges::find(lines, bus, name_of);
  return found == lines.end() ? nullptr : found->get();
}

canopen::CanopenBus* MachineBuses::find_network(std::string_view bus) const {
  const auto found = std::ranges::find(networks, bus, name_of);
  return found == networks.end() ? nullptr : found->get();
}

StopDelays MachineBuses::delays_of(std::string_view bus) const {
  const auto found = stop_delays.find(bus);
  return found == stop_delays.end() ? StopDelays{} : found->second;
}

}  // namespace axisd::core
