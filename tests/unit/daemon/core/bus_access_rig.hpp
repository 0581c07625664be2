// A machine with two axes and another device on one line, and what else may be there, in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/core/bus_access_service.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/fake_record_files.hpp"
#include "tests/support/register_node.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::core::test {

using namespace axisd::test;
using namespace std::chrono_literals;

/// Axes a1 and a2 (YKD2405PR, nodes 1 and 2, 1000 pulses/rev) and device io (node 9) on line-a, 115200 8N1.
class BusAccessRig : public testing::Test {
 protected:
  BusAccessRig() {
    configuration_.machine = "m";
    configuration_.flight_recorder.memory = 16;  // some 300 frames
    configuration_.lines.push_back({.name = "line-a", .port = "sim"});
    for (const std::uint8_t node : {1, 2}) {
      AxisSettings axis{
          .name = "a" + std::to_string(node), .bus = "line-a", .node = node, .model = "ykd2405pr"};
      axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
      axis.limits.velocity = 100;
      configuration_.axes.push_back({.axis = axis});
    }
    configuration_.devices.push_back({.name = "io",
                                      .bus = "line-a",
                                      .node = 9,
                                      .poll = 500ms,
                                      .values = {{.name = "level", .address = 1, .writable = true}}});
    machine_ = std::make_unique<MachineCore>(
        MachineParts{.executor = world_.executor(),
                     .clock = &world_.clock(),
                     .instance_id = "t",
                     .make_line =
                         [this](const modbus_rtu::LineSettings& settings) {
                           auto made = std::make_unique<VirtualLine>(world_, settings);
                           line_ = made.get();
                           return made;
                         },
                     .flight_records = &records_},
        configuration_);
    access_ = std::make_unique<BusAccessService>(world_.executor(), world_.clock(), *machine_);
    line_->network().advance(world_.now());
    for (const std::uint8_t node : {1, 2}) add_drive("ykd2405pr", {.address = node});
    io_ = &add(9, {{0, 0x4242}, {1, 77}});
  }
  ~BusAccessRig() override {
    machine_->close();
    EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, 60s));
    world_.run_for(100ms);
  }

  simulation::SimulatedRtuNode& add_drive(std::string_view model,
                                          const simulation::SimulatedNodeSettings& settings) {
    auto& drive = line_->network().add(simulation::find_simulator(model)->make(settings));
    drives_.push_back(&drive);
    return drive;
  }
  RegisterNode& add(std::uint8_t node, std::map<std::uint16_t, std::uint16_t> registers,
                    std::optional<simulation::Serial> serial = std::nullopt) {
    auto made = std::make_unique<RegisterNode>(node, std::move(registers), serial);
    return dynamic_cast<RegisterNode&>(line_->network().add(std::move(made)));
  }
  void start() {
    machine_->start();
    const auto online = [this] {
      return machine_->find("a1")->snapshot()->link == LinkState::online &&
             machine_->find("a2")->snapshot()->link == LinkState::online;
    };
    ASSERT_TRUE(world_.run_until(online, 10s));
    for (const char* axis : {"a1", "a2"}) submit(axis, DisableRequest{});  // the drives power up energised
    world_.run_for(1s);
    line_->forget_wire();
  }
  void submit(const std::string& axis, const Action& action) {
    const auto command = machine_->submit(axis, action, {});
    ASSERT_TRUE(command) << to_string(command.error());
    world_.run_for(500ms);
  }

  Result<std::vector<std::uint16_t>> transact(TransactRequest request) {
    std::optional<Result<std::vector<std::uint16_t>>> answer;
    access_->transact(std::move(request), [&](auto result) {
      EXPECT_FALSE(answer);
      answer = std::move(result);
    });
    EXPECT_TRUE(world_.run_until([&] { return answer.has_value(); }, 10s));
    return *answer;
  }
  [[nodiscard]] bool was_written(std::uint8_t node) const {
    return std::ranges::any_of(line_->wire(),
                               [&](const auto& entry) { return entry.node() == node && entry.is_write(); });
  }

  struct ScanLog {
    std::vector<FoundNode> found;
    std::vector<ScanProgress> reports;
    std::optional<Error> error;
    [[nodiscard]] bool over() const { return error || (!reports.empty() && reports.back().finished); }
    [[nodiscard]] const FoundNode* node(std::uint8_t node) const {
      const auto it = std::ranges::find(found, node, &FoundNode::node);
      return it == found.end() ? nullptr : &*it;
    }
  };
  std::shared_ptr<void> begin_scan(ScanRequest request, ScanLog& log) {
    request.bus = "line-a";
    return access_->scan(std::move(request), [&log](Result<ScanProgress> progress) {
      EXPECT_FALSE(log.over()) << "called after the end";
      if (!progress) {
        log.error = progress.error();
        return;
      }
      log.found.insert(log.found.end(), progress->found.begin(), progress->found.end());
      log.reports.push_back(std::move(*progress));
    });
  }
  ScanLog scan(ScanRequest request) {
    ScanLog log;
    const auto token = begin_scan(std::move(request), log);
    EXPECT_TRUE(world_.run_until([&] { return log.over(); }, 120s));
    return log;
  }

  VirtualWorld world_;
  FakeRecordFiles records_{world_.executor()};
  config::Configuration configuration_;
  VirtualLine* line_ = nullptr;
  std::unique_ptr<MachineCore> machine_;
  std::unique_ptr<BusAccessService> access_;
  std::vector<simulation::SimulatedRtuNode*> drives_;  ///< as they were added: a1, a2, ...
  RegisterNode* io_ = nullptr;
};

}  // namespace axisd::core::test
