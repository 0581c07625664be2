// A whole machine with one simulated CAN drive (YSS-C, or any by CiA 402) on a network in virtual time.
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
#include "devices/descriptor.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/fake_journal.hpp"
#include "tests/support/fake_persistence.hpp"
#include "tests/support/rig.hpp"
#include "tests/support/source_tree.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

/// A closed-loop drive as it is (M30): every reading is measured.
inline constexpr simulation::EncoderSettings measured_by_default{
    .noise = 1, .following = std::chrono::milliseconds(3), .quantised = true, .compliance = 10};

struct CanRigOptions {
  std::string model = "yss-c";  ///< or cia402
  bool invert = false;
  simulation::EncoderSettings encoder = measured_by_default;
  bool polled = false;  ///< it takes no TPDO: its state is asked for by SDO
  std::function<void(simulation::SimulatedNodeSettings&)> adjust_drive{};
  bool persistence = false;  ///< keep state between restarts in CanRig::store
  bool journal = false;      ///< and commands in CanRig::journal
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
/// switch at -50 mm, limit switches at -60 mm and 460 mm from where it powered up, in axis direction.
class CanRig {
 public:
  static constexpr std::uint8_t node_id = 5;

  explicit CanRig(CanRigOptions options = {})
      : store(world.executor()),
        journal(world.executor()),
        network(world.clock(), 1'000'000),
        options_(std::move(options)),
        drives_(world.clock(), network) {
    auto made = simulation::make_can_node(options_.model, drive_settings());
    if (!made) throw std::invalid_argument(to_string(made.error()));
    drive = &drives_.nodes().add(std::move(*made));
    drives_.nodes().set_observer(
        [this](TimePoint at, bool, const can::Frame& frame) { frames.emplace_back(at, frame); });
    run(std::chrono::seconds(1));
    if (options_.polled)
      nodes().add_fault(
          {.kind = simulation::FaultKind::abort, .count = -1, .object = 0x1A00, .code = 0x06010002});
    if (options_.before_start) options_.before_start(*drive);
    drives_.nodes().advance();
    configuration.machine = "test";
    configuration.networks.push_back(
        {.name = "can0", .interface = "sim", .sync_period = options_.sync_period});
    configuration.axes.push_back({.axis = axis_settings()});
    start_daemon();
  }
  ~CanRig() {
    network.set_fault({});  // what it refers to may be gone
    if (machine) stop_daemon();
  }

  void start_daemon() {
    frames.clear();
    store.restart();
    journal.restart(world.clock().wall(world.now()));
    core::MachineParts parts{.executor = world.executor(),
                             .clock = &world.clock(),
                             .persistence = options_.persistence ? &store : nullptr,
                             .journal = options_.journal ? &journal : nullptr,
                             .instance_id = "t" + std::to_string(++starts_),
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
  FakePersistence store;
  FakeJournal journal;
  can::Network network;
  config::Configuration configuration;
  simulation::SimulatedCanNode* drive = nullptr;
  std::unique_ptr<core::MachineCore> machine;
  std::vector<std::pair<TimePoint, can::Frame>> frames;  ///< that passed the wire, since start_daemon()

 private:
  [[nodiscard]] simulation::SimulatedNodeSettings drive_settings() const {
    simulation::SimulatedNodeSettings settings{
        .address = node_id, .encoder = options_.encoder, .switches = options_.switches};
    const auto pulses = [](double mm) { return static_cast<std::int64_t>(mm * 100); };
    const bool invert = options_.invert;
    if (options_.switches_near)
      settings.mechanics = {.home_switch_from = pulses(invert ? 50 : -52),
                            .home_switch_to = pulses(invert ? 52 : -50),
                            .positive_limit_from = pulses(invert ? 60 : 460),
                            .negative_limit_from = pulses(invert ? -460 : -60)};
    if (options_.adjust_drive) options_.adjust_drive(settings);
    return settings;
  }
  [[nodiscard]] AxisSettings axis_settings() const {
    const bool standard = options_.model == "cia402";
    AxisSettings axis{.name = "feeder", .bus = "can0", .node = node_id, .model = options_.model};
    // Else each release loses the position (M20).
    if (options_.model == "yss-c") axis.model_settings["released_position"] = std::string("counted");
    axis.scale = {
        .pulses_per_revolution = 1000, .travel_numerator = 10, .invert = options_.invert, .unit = "mm"};
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
    // Where a terminal has one meaning, it is that of the drive's direction.
    const bool turned = standard && options_.invert;
    axis.inputs = {
        {.terminal = standard ? "HOME" : "X0", .function = "home"},
        {.terminal = standard ? "POS" : "X1", .function = turned ? "negative_limit" : "positive_limit"},
        {.terminal = standard ? "NEG" : "X2", .function = turned ? "positive_limit" : "negative_limit"}};
    if (standard) {
      axis.model_settings = {{"eds", in_source_tree("config/examples/standard-drive.eds")},
                             {"velocity_unit", std::string("pulses_per_second")}};
      const auto* model = find_drive_model("cia402");
      auto made = model->specialise(*model, axis.model_settings);
      if (!made) throw std::invalid_argument(to_string(made.error()));
      axis.own_descriptor = *made;
    }
    if (options_.adjust) options_.adjust(axis);
    return axis;
  }

  CanRigOptions options_;
  int starts_ = 0;
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
