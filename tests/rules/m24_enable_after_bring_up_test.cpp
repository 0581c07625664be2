// M24: enabling right after bring-up, while each drive of a full network shows what its RPDO does with a
// SYNC.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
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
#include "tests/support/rig.hpp"
#include "tests/support/source_tree.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// Sixteen drives of one model, "a1" to "a16", on one network with SYNC.
class FullNetwork {
 public:
  static constexpr int count = 16;

  explicit FullNetwork(const std::string& model)
      : network_(world_.clock(), 1'000'000), drives_(world_.clock(), network_) {
    configuration_.machine = "test";
    configuration_.networks.push_back({.name = "can0", .interface = "sim", .sync_period = 10ms});
    for (int node = 1; node <= count; ++node) {
      auto made = simulation::make_can_node(model, {.address = static_cast<std::uint8_t>(node)});
      if (!made) throw std::invalid_argument(to_string(made.error()));
      drives_.nodes().add(std::move(*made));
      configuration_.axes.push_back({.axis = axis_of(model, node)});
    }
    world_.run_for(1s);  // they boot
    machine_ = std::make_unique<core::MachineCore>(
        core::MachineParts{.executor = world_.executor(),
                           .clock = &world_.clock(),
                           .instance_id = "t1",
                           .make_port =
                               [this](const canopen::NetworkSettings& settings) {
                                 return std::make_unique<can::NetworkPort>(
                                     world_.clock(),
                                     can::PortSettings{.bus = settings.name, .interface = settings.interface},
                                     network_);
                               }},
        configuration_);
    machine_->start();
  }
  ~FullNetwork() {
    machine_->close();
    EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, 60s)) << "sequences left over";
    world_.run_for(100ms);
  }
  FullNetwork(const FullNetwork&) = delete;

  [[nodiscard]] AxisSnapshotPtr state(const std::string& axis) { return machine_->find(axis)->snapshot(); }
  void run(Duration duration) { world_.run_for(duration); }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : configuration_.axes) all.push_back(entry.axis.name);
    return all;
  }
  [[nodiscard]] bool online() {
    const auto all = names();
    return world_.run_until(
        [&] {
          return std::ranges::all_of(
              all, [this](const auto& name) { return state(name)->link == LinkState::online; });
        },
        20s);
  }
  /// Enables all at once, and says which did not come to be.
  void enable_all() {
    std::vector<std::pair<std::string, CommandPtr>> commands;
    for (const auto& name : names()) {
      auto command = machine_->submit(name, EnableRequest{}, {});
      ASSERT_TRUE(command) << name << ": " << to_string(command.error());
      commands.emplace_back(name, *command);
    }
    ASSERT_TRUE(world_.run_until(
        [&] {
          return std::ranges::all_of(commands, [](const auto& one) { return one.second->has_ended(); });
        },
        30s));
    for (const auto& [name, command] : commands)
      EXPECT_EQ(command->value().state, CommandState::done) << name << ": " << describe(command->value());
  }

 private:
  static AxisSettings axis_of(const std::string& model, int node) {
    AxisSettings axis{.name = fmt::format("a{}", node),
                      .bus = "can0",
                      .node = static_cast<std::uint8_t>(node),
                      .model = model};
    axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
    axis.limits.velocity = 100;
    if (model != "cia402") return axis;
    axis.model_settings = {{"eds", in_source_tree("config/examples/standard-drive.eds")},
                           {"velocity_unit", std::string("pulses_per_second")}};
    const auto* base = find_drive_model("cia402");
    auto made = base->specialise(*base, axis.model_settings);
    if (!made) throw std::invalid_argument(to_string(made.error()));
    axis.own_descriptor = *made;
    return axis;
  }

  VirtualWorld world_;
  can::Network network_;
  simulation::NetworkNodes drives_;
  config::Configuration configuration_;
  std::unique_ptr<core::MachineCore> machine_;
};

class EnableAfterBringUp : public ::testing::TestWithParam<std::string> {};

/// Whichever of them is just showing it, and how far it has come.
TEST_P(EnableAfterBringUp, AllOfAFullNetworkComeOn) {
  for (auto after = Duration{}; after <= 2s; after += 83ms) {
    SCOPED_TRACE(fmt::format("{} ms after the last was online", after / 1ms));
    FullNetwork network(GetParam());
    ASSERT_TRUE(network.online());
    network.run(after);
    network.enable_all();
    for (const auto& name : network.names()) {
      EXPECT_TRUE(network.state(name)->enabled) << name;
      EXPECT_FALSE(network.state(name)->moving) << name;
    }
    network.run(2s);
    for (const auto& name : network.names()) EXPECT_EQ(network.state(name)->link, LinkState::online) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(M24, EnableAfterBringUp, ::testing::Values("cia402", "yss-c"),
                         [](const auto& one) { return one.param == "cia402" ? "cia402" : "yss_c"; });

}  // namespace
}  // namespace axisd::test
