// An RS-485 line in virtual time.
#include "tests/conformance/virtual_wire.hpp"

#include <stdexcept>
#include <utility>
#include <vector>

#include "devices/simulation/control.hpp"
#include "devices/simulation/drive_option.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/borrowed_node.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::conformance {

namespace {

std::unique_ptr<simulation::SimulatedRtuNode> make_drive(const std::string& text) {
  auto option = simulation::parse_drive(text);
  if (!option) throw std::invalid_argument(option.error().message);
  auto node = simulation::make_node(option->model, std::move(option->settings));
  if (!node) throw std::invalid_argument(node.error().message);
  return std::move(*node);
}

/// The line is the daemon's: each has one of its own, with the same drives on it.
class SerialWire final : public VirtualWire {
 public:
  SerialWire(test::VirtualWorld& world, const modbus_rtu::SerialSettings& serial,
             const std::vector<std::string>& drives)
      : world_(&world) {
    for (const auto& drive : drives) {
      drives_.push_back(make_drive(drive));
      drives_.back()->advance(world.now());
      drives_.back()->join({.baud = serial.baud, .format = serial.format});
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

}  // namespace

std::unique_ptr<VirtualWire> make_virtual_wire(test::VirtualWorld& world,
                                               const config::Configuration& configuration,
                                               const Plant& plant) {
  if (configuration.lines.size() != 1) throw std::invalid_argument("a plant has one bus");
  return std::make_unique<SerialWire>(world, configuration.lines.front().serial(), plant.drives);
}

}  // namespace axisd::conformance
