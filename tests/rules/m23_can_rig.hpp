// A whole machine with one simulated YSS-C on a CAN network in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "buses/can/network.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/rig.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

struct CanRigOptions {
  simulation::Switches switches{};
  Duration sync_period{};
  bool limits = true;
  bool switches_near = true;  ///< there are home and limit switches
  bool connect = true;
  std::function<void(AxisSettings&)> adjust{};
  /// Called between the drive's boot and the start of the daemon.
  std::function<void(simulation::SimulatedCanNode&)> before_start{};
};

/// The axis "feeder", node 5: 1000 pulses/rev, 10 mm/rev (100 pulses per mm), 0..400 mm, 100 mm/s; home
/// switch at -50 mm, limit switches at -60 mm and 460 mm from where it powered up.
class CanRig {
 public:
  static constexpr std::uint8_t node_id = 5;

  explicit CanRig(CanRigOptions options = {})
      : network(world.clock(), 1'000'000), options_(std::move(options)), drives_(world.clock(), network) {
    const auto pulses = [](double mm) { return static_cast<std::int64_t>(mm * 100); };
    simulation::SimulatedNodeSettings settings{.address = node_id, .switches = options_.switches};
    if (options_.switches_near)
      settings.mechanics = {.home_switch_from = pulses(-52),
                            .home_switch_to = pulses(-50),
                            .positive_limit_from = pulses(460),
                            .negative_limit_from = pulses(-60)};
    auto made = simulation::make_can_node("yss-c", std::move(settings));
    if (!made) throw std::invalid_argument(to_string(made.error()));
    drive = &drives_.nodes().add(std::move(*made));
    drives_.nodes().set_observer(
        [this](TimePoint at, bool, const can::Frame& frame) { frames.emplace_back(at, frame); });
    run(std::chrono::seconds(1));
    if (options_.before_start) options_.before_start(*drive);
    drives_.nodes().advance();
    configuration.machine = "test";
    configuration.networks.push_back(
        {.name = "can0", .interface = "sim", .sync_period = options_.sync_period});
    AxisSettings axis{.name = "feeder", .bus = "can0", .node = node_id, .model = "yss-c"};
    axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
    if (options_.limits) {
      axis.limits.position_minimum = 0;
      axis.limits.position_maximum = 400;
    }
    axis.limits.velocity = 100;
    axis.homing = HomingSettings{.method = HomingMethod::home_negative,
                                 .velocity = 20,
                                 .search_velocity = 2,
                                 .backoff = 5,
                                 .timeout = std::chrono::seconds(30)};
    axis.inputs = {{.terminal = "X0", .function = "home"},
                   {.terminal = "X1", .function = "positive_limit"},
                   {.terminal = "X2", .function = "negative_limit"}};
    if (options_.adjust) options_.adjust(axis);
    configuration.axes.push_back({.axis = std::move(axis)});
    start_daemon();
  }
  ~CanRig() {
    if (machine) stop_daemon();
  }

  void start_daemon() {
    frames.clear();
    core::MachineParts parts{.executor = world.executor(),
                             .clock = &world.clock(),
                             .instance_id = "t",
                             .make_port = [this](const canopen::NetworkSettings& settings) {
                               return std::make_unique<can::NetworkPort>(
                                   world.clock(),
                                   can::PortSettings{.bus = settings.name, .interface = settings.interface},
                                   network);
                             }};
    machine = std::make_unique<core::MachineCore>(std::move(parts), configuration);
    machine->start();
    if (options_.connect) reconnect();
  }
  void stop_daemon() {
    machine->close();
    EXPECT_TRUE(run_until([this] { return machine->closed(); }, std::chrono::seconds(60)))
        << "sequences left over";
    run(std::chrono::milliseconds(100));
    machine.reset();
  }
  void reconnect(Duration limit = std::chrono::seconds(10)) {
    EXPECT_TRUE(run_until([this] { return state()->link == LinkState::online; }, limit))
        << "not online: " << (state()->link_error ? to_string(*state()->link_error) : "");
  }

  [[nodiscard]] Axis& axis() { return *machine->find("feeder"); }
  [[nodiscard]] AxisSnapshotPtr state() { return axis().snapshot(); }
  void run(Duration duration) { world.run_for(duration); }
  bool run_until(const std::function<bool()>& done, Duration limit) { return world.run_until(done, limit); }
  [[nodiscard]] simulation::CanNodes& nodes() { return drives_.nodes(); }

  CommandPtr submit(const Action& action) {
    auto command = machine->submit("feeder", action, {});
    if (!command) throw std::runtime_error(to_string(command.error()));
    return *command;
  }
  Command complete(const Action& action, Duration limit = std::chrono::seconds(60)) {
    const auto command = submit(action);
    EXPECT_TRUE(run_until([&] { return command->has_ended(); }, limit))
        << to_string(kind_of(action)) << " did not end";
    return command->value();
  }
  void done(const Action& action) {
    const auto command = complete(action);
    EXPECT_EQ(command.state, CommandState::done) << to_string(kind_of(action)) << ' ' << describe(command);
  }
  /// Enables and declares the position 0.
  void ready() {
    done(EnableRequest{});
    done(SetPositionRequest{.position = 0});
  }
  /// Changes the drive or its surroundings directly.
  void touch(const std::function<void(simulation::SimulatedCanNode&)>& how) {
    nodes().advance();
    how(*drive);
    nodes().advance();
  }
  void cycle_power(Duration off = std::chrono::milliseconds(1)) {
    touch([](auto& node) { node.set_power(false); });
    run(off);
    touch([](auto& node) { node.set_power(true); });
  }
  /// Pulses from where the load stood at power-up: what really happened.
  [[nodiscard]] std::int64_t shaft() {
    nodes().advance();
    return drive->shaft_pulses();
  }
  /// What was written to an object by SDO, in order.
  [[nodiscard]] std::vector<std::uint32_t> writes_of(std::uint32_t address) const {
    std::vector<std::uint32_t> values;
    for (const auto& [at, frame] : frames) {
      const auto& data = frame.data;
      const bool write = frame.id == 0x600U + node_id && (data[0] & 0xE0U) == 0x20U;
      if (!write || (std::uint32_t{data[2]} << 16U | std::uint32_t{data[1]} << 8U | data[3]) != address)
        continue;
      values.push_back(data[4] | std::uint32_t{data[5]} << 8U | std::uint32_t{data[6]} << 16U |
                       std::uint32_t{data[7]} << 24U);
    }
    return values;
  }
  [[nodiscard]] long count_of(std::uint32_t id) const {
    return std::ranges::count_if(frames, [id](const auto& entry) { return entry.second.id == id; });
  }

  VirtualWorld world;
  can::Network network;
  config::Configuration configuration;
  simulation::SimulatedCanNode* drive = nullptr;
  std::unique_ptr<core::MachineCore> machine;
  std::vector<std::pair<TimePoint, can::Frame>> frames;  ///< that passed the wire, since start_daemon()

 private:
  CanRigOptions options_;
  simulation::NetworkNodes drives_;
};

/// Runs `test` with the drive as it is by default, and with each of these open points the other way.
inline void for_each_reading(const CanRigOptions& base, const std::vector<std::vector<const char*>>& flips,
                             const std::function<void(const CanRigOptions&)>& test) {
  test(base);
  const auto specs = simulation::find_simulator("yss-c")->switches;
  for (const auto& flip : flips) {
    auto options = base;
    std::string names;
    for (const auto* name : flip) {
      const auto spec = std::ranges::find(specs, name, &simulation::SwitchSpec::name);
      if (spec == specs.end()) throw std::invalid_argument(name);
      options.switches[name] = !spec->default_value;
      names += std::string(" ") + name;
    }
    SCOPED_TRACE("other reading:" + names);
    test(options);
  }
}

}  // namespace axisd::test
