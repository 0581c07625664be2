// A machine with axes on one line, in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <memory>
#include <string>

#include "daemon/core/machine_core.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/fake_persistence.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::core {

/// Axes a1, a2 ... by their nodes on line-a.
class MachineOnALine : public testing::Test {
 protected:
  MachineOnALine(const std::string& name, std::initializer_list<std::uint8_t> nodes)
      : store_(world_.executor()) {
    configuration_.machine = name;
    configuration_.lines.push_back({.name = "line-a", .port = "sim"});
    for (const auto node : nodes) configuration_.axes.push_back({.axis = axis(node)});
  }
  ~MachineOnALine() override {
    if (!machine_) return;
    machine_->close();
    EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, std::chrono::seconds(60)));
  }
  static AxisSettings axis(std::uint8_t node) {
    AxisSettings axis{
        .name = "a" + std::to_string(node), .bus = "line-a", .node = node, .model = "ykd2405pr"};
    axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
    axis.limits.velocity = 100;
    return axis;
  }
  /// Runs for 2 s, with drives at these nodes, of which `unpowered` has no power.
  void start_with(std::initializer_list<std::uint8_t> drives, std::uint8_t unpowered = 0) {
    machine_ = std::make_unique<MachineCore>(
        MachineParts{.executor = world_.executor(),
                     .clock = &world_.clock(),
                     .persistence = &store_,
                     .audit = audit_,
                     .instance_id = "t",
                     .make_line =
                         [this](const modbus_rtu::LineSettings& settings) {
                           auto made = std::make_unique<test::VirtualLine>(world_, settings);
                           line_ = made.get();
                           return made;
                         }},
        configuration_);
    for (const auto node : drives)
      line_->network().add(
          simulation::find_simulator("ykd2405pr")->make({.address = node, .powered = node != unpowered}));
    line_->network().advance(world_.now());
    machine_->start();
    world_.run_for(std::chrono::seconds(2));
  }

  test::VirtualWorld world_;
  test::FakePersistence store_;
  AuditSink* audit_ = nullptr;  ///< set it before start_with(), and let it outlive the machine
  config::Configuration configuration_;
  test::VirtualLine* line_ = nullptr;
  std::unique_ptr<MachineCore> machine_;
};

}  // namespace axisd::core
