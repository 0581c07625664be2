#include "daemon/ports.hpp"

#include <utility>

#include "buses/can/socketcan_port.hpp"
#include "buses/modbus_rtu/rtu_worker.hpp"

namespace axisd {

Ports::Ports(core::CoreLoop& loop, const std::string& link_helper)
    : loop_(&loop), link_client_(loop.executor(), loop.clock(), link_helper) {}

Result<std::unique_ptr<Ports>> Ports::open(core::CoreLoop& loop, const config::Configuration& configuration,
                                           const std::string& link_helper) {
  std::unique_ptr<Ports> ports(new Ports(loop, link_helper));
  auto lines = SimulatedLines::open(configuration);
  if (!lines) return fail(lines.error());
  ports->lines_ = std::move(*lines);
  auto networks = SimulatedNetworks::open(loop.clock(), configuration);
  if (!networks) return fail(networks.error());
  ports->networks_ = std::move(*networks);
  ports->simulation_ =
      std::make_unique<SimulationControl>(loop, *ports->lines_, *ports->networks_, configuration);
  return ports;
}

std::unique_ptr<modbus_rtu::Line> Ports::make_line(const modbus_rtu::LineSettings& settings) {
  modbus_rtu::RtuWorker::PortPath path;
  if (settings.simulated())
    path = [this, name = settings.name]() -> Result<std::string> { return lines_->path(name); };
  return std::make_unique<modbus_rtu::RtuWorker>(loop_->executor(), settings, std::move(path));
}

std::unique_ptr<can::Port> Ports::make_port(const canopen::NetworkSettings& settings) {
  can::PortSettings port{.bus = settings.name, .interface = settings.interface, .bitrate = settings.bitrate};
  if (auto* network = networks_->find(settings.name); network != nullptr)
    return std::make_unique<can::NetworkPort>(loop_->clock(), std::move(port), *network);
  return std::make_unique<can::SocketCanPort>(loop_->executor(), loop_->clock(), std::move(port));
}

void Ports::reconfigure(const config::Configuration& configuration,
                        const std::vector<ConfigurationChange>& changes) {
  lines_->reconfigure(configuration, changes);
  networks_->reconfigure(configuration, changes);
  simulation_->reconfigure(configuration);
}

core::LinkHelper Ports::link_helper() {
  return {.cycle = [this](const std::string& interface,
                          core::LinkClient::Done done) { link_client_.cycle(interface, std::move(done)); },
          .check = [this](const std::string& interface,
                          core::LinkClient::Done done) { link_client_.check(interface, std::move(done)); }};
}

}  // namespace axisd
