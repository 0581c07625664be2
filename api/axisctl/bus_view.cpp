#include "api/axisctl/bus_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "config/text.hpp"

namespace axisd::axisctl {
namespace {

Colour state_colour(const v1::Bus& bus) {
  if (!bus.open()) return Colour::red;
  return bus.has_error() || bus.network().has_link_helper_error() ? Colour::yellow : Colour::none;
}

/// Why, without the bus's own name.
std::string cause(v1::ErrorDetail error) {
  error.clear_bus();
  return describe(error);
}

std::string foreign_nodes(const v1::NetworkStatus& network) {
  std::string text;
  for (const auto node : network.foreign_nodes()) text += fmt::format("{}{}", text.empty() ? "" : " ", node);
  return text;
}

std::string sync(const v1::NetworkStatus& network) {
  if (!network.has_sync_period()) return "none";
  return fmt::format("every {}, {}; {} sent, {} missed, latest {}",
                     duration_text(seconds(network.sync_period())),
                     network.sync_running() ? "running" : "not running", network.sync_sent(),
                     network.sync_missed(), duration_text(seconds(network.sync_latest())));
}

std::string line(std::string_view name, std::string_view value) {
  return value.empty() ? "" : fmt::format("{:<15}{}\n", fmt::format("{}:", name), value);
}

std::string counters(const v1::Bus& bus) {
  return line("transactions", fmt::format("{}, {} timeouts, {} corrupt, {} exceptions", bus.transactions(),
                                          bus.timeouts(), bus.corrupt_replies(), bus.exceptions())) +
         line("not sent",
              fmt::format("{} expired, {} superseded", bus.dropped_expired(), bus.dropped_superseded())) +
         line("line", fmt::format("{} foreign frames, {} I/O errors", bus.foreign_frames(), bus.io_errors()));
}

std::string counters(const v1::NetworkStatus& network) {
  return line("frames",
              fmt::format("{} sent, {} received, {} not sent, {} perhaps sent", network.frames_sent(),
                          network.frames_received(), network.frames_not_sent(), network.frames_unknown())) +
         line("errors",
              fmt::format("{} error frames, {} bus-off, {} stalls, {} lost at reading, {} waits for "
                          "the interface's queue",
                          network.error_frames(), network.bus_offs(), network.stalls(),
                          network.receive_overflows(), network.no_buffer())) +
         line("SDO",
              fmt::format("{} transfers, {} aborts, {} timeouts, {} protocol errors", network.sdo_transfers(),
                          network.sdo_aborts(), network.sdo_timeouts(), network.sdo_protocol_errors())) +
         line("SYNC", sync(network)) + line("emergencies", std::to_string(network.emergencies())) +
         line("foreign nodes", foreign_nodes(network)) +
         line("other frames",
              fmt::format("{} of foreign nodes, {} of no known service, {} malformed",
                          network.foreign_frames(), network.unknown_frames(), network.malformed_frames()));
}

}  // namespace

Failure no_such_bus(const std::string& name, const v1::ListBusesResponse& buses) {
  std::vector<std::string> names;
  for (const auto& bus : buses.buses()) names.push_back(bus.name());
  return {ExitCode::usage, fmt::format("there is no bus {}; {}", config::quoted(name),
                                       did_you_mean(name, names, "axisctl bus list"))};
}

bool is_network(const v1::Bus& bus) { return bus.kind() == v1::BUS_KIND_CANOPEN; }

std::string bus_state(const v1::Bus& bus) {
  std::string text = bus.open() ? "open" : "closed";
  if (bus.has_network()) text = lower_word(v1::NetworkLink_Name(bus.network().link()), "NETWORK_LINK_");
  if (bus.has_error()) text += ": " + cause(bus.error());
  if (bus.simulated()) text += ", simulated";
  if (bus.network().has_link_helper_error())
    text += ", not cycled after bus-off: " + cause(bus.network().link_helper_error());
  return text;
}

Table line_table(const v1::ListBusesResponse& buses) {
  Table table({"BUS", "PORT", "BAUD", "TRANSACTIONS", "TIMEOUTS", "CORRUPT", "EXCEPTIONS", "FOREIGN",
               "EXPIRED", "SUPERSEDED", "I/O ERRORS", "STATE"},
              {2, 3, 4, 5, 6, 7, 8, 9, 10});
  for (const auto& bus : buses.buses()) {
    if (is_network(bus)) continue;
    table.add({bus.name(),
               bus.port(),
               std::to_string(bus.baud()),
               std::to_string(bus.transactions()),
               std::to_string(bus.timeouts()),
               std::to_string(bus.corrupt_replies()),
               std::to_string(bus.exceptions()),
               std::to_string(bus.foreign_frames()),
               std::to_string(bus.dropped_expired()),
               std::to_string(bus.dropped_superseded()),
               std::to_string(bus.io_errors()),
               {bus_state(bus), state_colour(bus)}});
  }
  return table;
}

Table network_table(const v1::ListBusesResponse& buses) {
  Table table({"BUS", "INTERFACE", "BIT/S", "SENT", "RECEIVED", "NOT SENT", "SDO", "ABORTS", "TIMEOUTS",
               "SYNC", "MISSED", "EMCY", "FOREIGN", "STATE"},
              {2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  for (const auto& bus : buses.buses()) {
    if (!is_network(bus)) continue;
    const auto& network = bus.network();
    table.add({bus.name(),
               bus.port(),
               std::to_string(bus.baud()),
               std::to_string(network.frames_sent()),
               std::to_string(network.frames_received()),
               std::to_string(network.frames_not_sent() + network.frames_unknown()),
               std::to_string(network.sdo_transfers()),
               std::to_string(network.sdo_aborts()),
               std::to_string(network.sdo_timeouts()),
               std::to_string(network.sync_sent()),
               std::to_string(network.sync_missed()),
               std::to_string(network.emergencies()),
               {foreign_nodes(network), Colour::yellow},
               {bus_state(bus), state_colour(bus)}});
  }
  return table;
}

std::string bus_details(const v1::Bus& bus) {
  const bool network = is_network(bus);
  auto text = line("bus", bus.name()) + line("kind", network ? "CAN network" : "RS-485 line") +
              line(network ? "interface" : "port", bus.port()) +
              line(network ? "bit rate" : "baud", fmt::format("{} bit/s", bus.baud())) +
              line("state", bus_state(bus));
  return text + (network ? counters(bus.network()) : counters(bus));
}

Table object_table(std::uint32_t address, const v1::TransactResponse& object) {
  std::string hexadecimal;
  for (const auto byte : object.data())
    hexadecimal += fmt::format("{}{:02X}", hexadecimal.empty() ? "" : " ", static_cast<std::uint8_t>(byte));
  constexpr auto printable = [](char c) { return c >= ' ' && c <= '~'; };
  const bool text = object.data().size() > 1 && std::ranges::all_of(object.data(), printable);
  Table table({"OBJECT", "BYTES", "VALUE", "TEXT"}, {2});
  table.add({address_text(address), hexadecimal, object.has_value() ? std::to_string(object.value()) : "",
             text ? object.data() : ""});
  return table;
}

}  // namespace axisd::axisctl
