#include "tests/conformance/virtual_wire.hpp"

#include <stdexcept>
#include <utility>
#include <vector>

#include "buses/can/network.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/control.hpp"
#include "devices/simulation/drive_option.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/borrowed_node.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::conformance {

namespace {

template <class Node>
using Make = Result<std::unique_ptr<Node>> (*)(std::string_view model, simulation::SimulatedNodeSettings);

template <class Node>
std::unique_ptr<Node> make_drive(const std::string& text, Make<Node> make) {
  auto option = simulation::parse_drive(text);
  if (!option) throw std::invalid_argument(option.error().message);
  auto node = make(option->model, std::move(option->settings));
  if (!node) throw std::invalid_argument(node.error().message);
  return std::move(*node);
}

/// An RS-485 line. It is the daemon's: each has one of its own, with the same drives on it.
class SerialWire final : public VirtualWire {
 public:
  SerialWire(test::VirtualWorld& world, const modbus_rtu::SerialSettings& serial,
             const std::vector<std::string>& drives)
      : world_(&world) {
    for (const auto& text : drives) {
      auto& drive =
          *drives_.emplace_back(make_drive<simulation::SimulatedRtuNode>(text, &simulation::make_node));
      drive.advance(world.now());
      drive.join({.baud = serial.baud, .format = serial.format});
    }
  }

  void connect(core::MachineParts& parts) override {
    parts.make_line = [this](const modbus_rtu::LineSettings& settings) {
      auto made = std::make_unique<test::VirtualLine>(*world_, settings);
      line_ = made.get();
      return made;
    };
  }
  void attach_drives() override {
    line_->network().advance(world_->now());
    for (const auto& drive : drives_) line_->network().add(std::make_unique<test::BorrowedNode>(*drive));
  }
  void detach() override { line_ = nullptr; }
  std::string control(std::string_view line) override {
    line_->network().advance(world_->now());
    return simulation::execute_control(line_->network(), line);
  }

 private:
  test::VirtualWorld* world_;
  std::vector<std::unique_ptr<simulation::SimulatedRtuNode>> drives_;
  test::VirtualLine* line_ = nullptr;
};

/// A CAN network: the drives are on it whether there is a daemon or not.
class CanWire final : public VirtualWire {
 public:
  CanWire(test::VirtualWorld& world, std::uint32_t bitrate, const std::vector<std::string>& drives)
      : clock_(&world.clock()), network_(world.clock(), bitrate), drives_(world.clock(), network_) {
    for (const auto& text : drives)
      drives_.nodes().add(make_drive<simulation::SimulatedCanNode>(text, &simulation::make_can_node));
  }

  void connect(core::MachineParts& parts) override {
    parts.make_port = [this](const canopen::NetworkSettings& settings) {
      return std::make_unique<can::NetworkPort>(
          *clock_,
          can::PortSettings{
              .bus = settings.name, .interface = settings.interface, .bitrate = settings.bitrate},
          network_);
    };
  }
  void attach_drives() override {}
  void detach() override {}
  std::string control(std::string_view line) override {
    return simulation::execute_control(drives_.nodes(), line);
  }

 private:
  Clock* clock_;
  can::Network network_;
  simulation::NetworkNodes drives_;
};

}  // namespace

std::unique_ptr<VirtualWire> make_virtual_wire(test::VirtualWorld& world,
                                               const config::Configuration& configuration,
                                               const Plant& plant) {
  const auto& lines = configuration.lines;
  const auto& networks = configuration.networks;
  if (lines.size() + networks.size() != 1) throw std::invalid_argument("a plant has one bus");
  if (!lines.empty()) return std::make_unique<SerialWire>(world, lines.front().serial(), plant.drives);
  return std::make_unique<CanWire>(world, networks.front().bitrate, plant.drives);
}

}  // namespace axisd::conformance
