// Buses, axes and devices as the configuration names them. Nothing here touches a wire.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <stdexcept>
#include <utility>

#include "daemon/core/machine_core.hpp"
#include "daemon/core/observed_port.hpp"
#include "devices/generic/canopen_device.hpp"
#include "devices/generic/modbus_device.hpp"

namespace axisd::core {

BusRecorder& MachineCore::add_recorder(const std::string& bus, int bit_rate, std::size_t memory) {
  recorders_.push_back(std::make_unique<BusRecorder>(bus, memory, bit_rate, *parts_.clock, parts_.observer));
  return *recorders_.back();
}

void MachineCore::add_line(const modbus_rtu::LineSettings& line, std::size_t memory) {
  add_recorder(line.name, 0, memory);
  buses_.lines.push_back(
      std::make_unique<modbus_rtu::RtuBus>(parts_.executor, *parts_.clock, line, parts_.make_line(line)));
  buses_.all.push_back(buses_.lines.back().get());
}

void MachineCore::add_network(const canopen::NetworkSettings& network, std::size_t memory) {
  auto& recorder = add_recorder(network.name, static_cast<int>(network.bitrate), memory);
  buses_.networks.push_back(std::make_unique<canopen::CanopenBus>(
      parts_.executor, *parts_.clock, network,
      std::make_unique<ObservedPort>(parts_.make_port(network), *parts_.clock, recorder.network_observer())));
  buses_.all.push_back(buses_.networks.back().get());
  buses_.cyclers.push_back(std::make_unique<LinkCycler>(parts_.executor, *parts_.clock,
                                                        *buses_.networks.back(), parts_.link_helper));
}

std::unique_ptr<Axis> MachineCore::make_axis(const AxisSettings& settings, AxisFacePtr face) {
  auto* bus = find_bus(settings.bus);
  const auto* descriptor = descriptor_of(settings);
  auto setup =
      descriptor == nullptr ? fail(Reason::internal, "unknown model") : drive_setup(settings, *descriptor);
  // The loader has refused all of this with its position in the file.
  if (bus == nullptr || !setup)
    throw std::invalid_argument(
        fmt::format("axis {}: {}", settings.name, setup ? "unknown bus" : setup.error().message));
  auto* line = find_line(settings.bus);
  auto drive = descriptor->make({.executor = parts_.executor,
                                 .clock = parts_.clock,
                                 .rtu = line,
                                 .canopen = find_network(settings.bus),
                                 .node = settings.node,
                                 .setup = std::move(*setup)});
  if (line != nullptr && settings.turnaround_max)
    line->set_turnaround_max(settings.node, settings.turnaround_max);
  if (!face) face = std::make_shared<AxisFace>(bus->stop_notice());
  const bool brake =
      std::ranges::any_of(settings.outputs, [](const auto& o) { return o.function == "brake"; });
  if (settings.vertical && !brake)
    spdlog::warn("{}: load: vertical, but no output has the function brake", settings.name);  // M2
  return std::make_unique<Axis>(
      AxisEnvironment{.executor = parts_.executor,
                      .clock = parts_.clock,
                      .bus = bus,
                      .book = &book_,
                      .persistence = parts_.persistence,
                      .leases = &leases_.table(),
                      .inhibited = inhibit_.latched(),
                      .state_unaccepted = state_gate_.refusal(),
                      .holds = holds_.of(settings.name),
                      .stop_delays = &buses_.stop_delays[settings.bus],
                      .published = parts_.published,
                      .event = [this](const std::string& axis,
                                      EventContent content) { on_event(axis, std::move(content)); }},
      settings, *descriptor, std::move(drive), std::move(face), bus->simulated());
}

std::unique_ptr<Device> MachineCore::make_device(const DeviceSettings& settings) {
  auto* line = find_line(settings.bus);
  auto* network = find_network(settings.bus);
  if (settings.kind == BusKind::modbus_rtu && line != nullptr) {
    if (settings.turnaround_max) line->set_turnaround_max(settings.node, settings.turnaround_max);
    return std::make_unique<ModbusDevice>(parts_.executor, *parts_.clock, *line, settings);
  }
  if (settings.kind == BusKind::canopen && network != nullptr)
    return std::make_unique<CanopenDevice>(parts_.executor, *parts_.clock, *network, settings);
  throw std::invalid_argument(fmt::format("device {}: no bus for it", settings.name));
}

void MachineCore::publish_table() {
  auto next = boost::make_shared<MachineTable>();
  for (const auto& axis : axes_) {
    next->axes.push_back(axis->settings().name);
    next->faces.emplace(axis->settings().name, axis->face());
  }
  for (const auto& device : devices_) next->devices.push_back(device->face());
  next->groups = groups_.groups();
  table_.store(std::move(next));
}

}  // namespace axisd::core
