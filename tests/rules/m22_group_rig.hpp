// A machine with three axes on two buses in virtual time, and the truth about when each of them moved.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "buses/can/network.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/rig.hpp"
#include "tests/support/virtual_line.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

using namespace std::chrono_literals;

struct GroupRigOptions {
  int baud = 115200;
  int can_axes = 1;          ///< z, and w beside it
  int more_serial_axes = 0;  ///< a, b, ... (nodes 11, 12, ...; ykd2405pr)
  Duration sync_period = 10ms;
  simulation::Switches can_switches{}, serial_switches{};
  LeaseLoss on_lease_loss = LeaseLoss::halt;
  std::function<void(AxisSettings&)> adjust{};
};

/// Axes x (node 1, ykd2405pr) and y (node 2, ess42-r) on an RS-485 line, z (node 5, yss-c) on a CAN network;
/// all with 100 pulses per mm, 0..400 mm, 100 mm/s, enabled, at 0.
class GroupRig {
 public:
  explicit GroupRig(GroupRigOptions options = {})
      : network_(world.clock(), 1'000'000), nodes_(world.clock(), network_) {
    configuration.machine = "test";
    configuration.lines.push_back({.name = "line-a", .port = "sim", .baud = options.baud});
    configuration.networks.push_back(
        {.name = "can0", .interface = "sim", .sync_period = options.sync_period});
    add_serial("x", 1, "ykd2405pr", options);
    add_serial("y", 2, "ess42-r", options);
    for (int i = 0; i < options.more_serial_axes; ++i)
      add_serial(std::string(1, static_cast<char>('a' + i)), static_cast<std::uint8_t>(11 + i), "ykd2405pr",
                 options);
    for (int i = 0; i < options.can_axes; ++i)
      add_can(i == 0 ? "z" : "w", static_cast<std::uint8_t>(5 + i), options);
    run(1s);
    core::MachineParts parts{
        .executor = world.executor(),
        .clock = &world.clock(),
        .instance_id = "t",
        .make_line =
            [this](const modbus_rtu::LineSettings& settings) {
              auto made = std::make_unique<VirtualLine>(world, settings);
              line = made.get();
              return made;
            },
        .make_port =
            [this](const canopen::NetworkSettings& settings) {
              return std::make_unique<can::NetworkPort>(
                  world.clock(), can::PortSettings{.bus = settings.name, .interface = settings.interface},
                  network_);
            }};
    machine = std::make_unique<core::MachineCore>(std::move(parts), configuration);
    line->network().advance(world.now());
    for (auto& drive : serial_) line->network().add(std::make_unique<BorrowedNode>(*drive));
    machine->start();
    EXPECT_TRUE(run_until([this] { return all(LinkState::online); }, 10s)) << "not online";
    run(3s);  // what can start by SYNC has shown it
    for (const auto& axis : configuration.axes) ready(axis.axis.name);
    line->forget_wire();
  }
  ~GroupRig() {
    machine->close();
    EXPECT_TRUE(run_until([this] { return machine->closed(); }, 60s)) << "sequences left over";
    run(100ms);
    machine.reset();
  }
  GroupRig(const GroupRig&) = delete;

  VirtualWorld world;
  config::Configuration configuration;
  VirtualLine* line = nullptr;
  std::unique_ptr<core::MachineCore> machine;

  [[nodiscard]] Axis& axis(const std::string& name) { return *machine->find(name); }
  [[nodiscard]] AxisSnapshotPtr state(const std::string& name) { return axis(name).snapshot(); }
  void run(Duration duration) { world.run_for(duration); }
  bool run_until(const std::function<bool()>& done, Duration limit) { return world.run_until(done, limit); }
  simulation::FaultPlan& faults() { return line->network().faults(); }
  simulation::CanNodes& can() { return nodes_.nodes(); }

  /// Everybody to these places, in mm.
  static GroupMoveRequest to(const std::map<std::string, double>& places, bool together = true) {
    GroupMoveRequest request{.arrive_together = together};
    for (const auto& [axis, place] : places) request.targets.push_back({.axis = axis, .position = place});
    return request;
  }
  Result<GroupRunPtr> try_move(const GroupMoveRequest& request, const CommandOptions& options = {}) {
    return machine->groups().move(request, options);
  }
  GroupRunPtr move(const GroupMoveRequest& request, const CommandOptions& options = {}) {
    auto run = try_move(request, options);
    if (!run) throw std::runtime_error(to_string(run.error()));
    return *run;
  }
  GroupMove complete(const GroupMoveRequest& request, Duration limit = 60s) {
    const auto run = move(request);
    EXPECT_TRUE(run_until([&] { return ended(run->state()); }, limit)) << "it does not end";
    this->run(1ms);
    return run->value();
  }
  void ready(const std::string& axis) {
    for (const Action& action : {Action(EnableRequest{}), Action(SetPositionRequest{.position = 0})}) {
      const auto command = machine->submit(axis, action, {});
      ASSERT_TRUE(command) << to_string(command.error());
      ASSERT_TRUE(run_until([&] { return (*command)->has_ended(); }, 10s));
      ASSERT_EQ((*command)->value().state, CommandState::done) << describe((*command)->value());
    }
  }
  [[nodiscard]] bool all(LinkState link) {
    for (const auto& axis : configuration.axes)
      if (state(axis.axis.name)->link != link) return false;
    return true;
  }

  // The truth.
  [[nodiscard]] double load_mm(const std::string& axis) {
    settle();
    return static_cast<double>(shaft_.at(axis)()) / 100;
  }
  [[nodiscard]] int starts(const std::string& axis) { return starts_.at(axis)(); }
  struct Journey {
    std::optional<TimePoint> begun, ended;  ///< the first and the last pulse
    [[nodiscard]] Duration time() const { return *ended - *begun; }
  };
  /// Watches the shafts while `duration` passes, with a tenth of a millisecond of blur.
  std::map<std::string, Journey> watch(Duration duration) {
    std::map<std::string, Journey> journeys;
    std::map<std::string, double> before;
    for (const auto& [axis, shaft] : shaft_) before[axis] = load_mm(axis);
    for (const auto end = world.now() + duration; world.now() < end;) {
      run(100us);
      for (auto& [axis, place] : before) {
        const auto now = load_mm(axis);
        if (now == std::exchange(place, now)) continue;
        auto& journey = journeys[axis];
        if (!journey.begun) journey.begun = world.now();
        journey.ended = world.now();
      }
    }
    return journeys;
  }
  /// True: nothing moved within `duration`.
  bool rests(Duration duration) {
    std::map<std::string, double> before;
    for (const auto& [axis, shaft] : shaft_) before[axis] = load_mm(axis);
    run(duration);
    return std::ranges::all_of(before, [&](const auto& was) { return load_mm(was.first) == was.second; });
  }
  [[nodiscard]] int writes(std::uint8_t node, std::uint16_t address) const {
    return static_cast<int>(std::ranges::count_if(line->wire(), [&](const WireEntry& entry) {
      return entry.node() == node && entry.is_write() && entry.address() == address;
    }));
  }
  simulation::SimulatedRtuNode& serial(std::size_t index) { return *serial_.at(index); }

 private:
  void settle() {
    line->network().advance(world.now());
    nodes_.nodes().advance();
  }
  AxisSettings settings(const std::string& name, std::uint8_t node, const std::string& model,
                        const std::string& bus, const GroupRigOptions& options) {
    AxisSettings axis{.name = name, .bus = bus, .node = node, .model = model};
    axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
    axis.limits.position_minimum = 0;
    axis.limits.position_maximum = 400;
    axis.limits.velocity = 100;
    axis.on_lease_loss = options.on_lease_loss;
    axis.position_tolerance = 0.02;
    if (options.adjust) options.adjust(axis);
    return axis;
  }
  void add_serial(const std::string& name, std::uint8_t node, const std::string& model,
                  const GroupRigOptions& options) {
    serial_.push_back(
        simulation::find_simulator(model)->make({.address = node, .switches = options.serial_switches}));
    serial_.back()->advance(world.now());
    shaft_[name] = [drive = serial_.back().get()] { return drive->shaft_pulses(); };
    starts_[name] = [drive = serial_.back().get()] { return drive->starts(); };
    configuration.axes.push_back({.axis = settings(name, node, model, "line-a", options)});
  }
  void add_can(const std::string& name, std::uint8_t node, const GroupRigOptions& options) {
    auto made = simulation::make_can_node("yss-c", {.address = node, .switches = options.can_switches});
    if (!made) throw std::runtime_error(to_string(made.error()));
    auto& drive = nodes_.nodes().add(std::move(*made));
    shaft_[name] = [&drive] { return drive.shaft_pulses(); };
    starts_[name] = [&drive] { return drive.starts(); };
    configuration.axes.push_back({.axis = settings(name, node, "yss-c", "can0", options)});
  }

  can::Network network_;
  simulation::NetworkNodes nodes_;
  std::vector<std::unique_ptr<simulation::SimulatedRtuNode>> serial_;
  std::map<std::string, std::function<std::int64_t()>> shaft_;
  std::map<std::string, std::function<int()>> starts_;
};

}  // namespace axisd::test
