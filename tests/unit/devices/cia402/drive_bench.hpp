// A CiA 402 driver and a simulated YSS-C on one network, in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>

#include "buses/can/network.hpp"
#include "buses/canopen/canopen_bus.hpp"
#include "devices/cia402/drive.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/yss_c/model.hpp"
#include "devices/yss_c/simulator.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::cia402 {

class DriveBench {
 public:
  static constexpr std::uint8_t node = 5;

  explicit DriveBench(simulation::SimulatedNodeSettings simulated = {}, DriveSetup setup = plain_setup(),
                      Duration sync_period = {})
      : nodes_(world_.clock(), network_),
        bus_(world_.executor(), world_.clock(),
             canopen::NetworkSettings{.name = "can0", .interface = "sim", .sync_period = sync_period},
             std::make_unique<can::NetworkPort>(
                 world_.clock(), can::PortSettings{.bus = "can0", .interface = "sim", .bitrate = 1'000'000},
                 network_)) {
    simulated.address = simulated.address == 1 ? node : simulated.address;
    simulated_ = &nodes_.nodes().add(std::make_unique<yss_c::SimulatedDrive>(std::move(simulated)));
    world_.run_for(std::chrono::seconds(1));  // it boots
    DriveContext context{.executor = world_.executor(), .clock = &world_.clock(), .canopen = &bus_};
    context.node = simulated_->address();
    context.setup = std::move(setup);
    drive_ = make_drive(yss_c::model(), std::move(context));
    bus_.start();
    world_.run_for(std::chrono::milliseconds(10));
  }
  ~DriveBench() {
    bus_.close();
    world_.run_for(std::chrono::seconds(5));
  }
  DriveBench(const DriveBench&) = delete;

  static DriveSetup plain_setup() {
    DriveSetup setup;
    setup.pulses_per_revolution = 4000;
    setup.model_settings = {{"overtravel_stop", SettingValue(std::string("quick_stop"))},
                            {"loop_mode", SettingValue(std::string("closed"))}};
    return setup;
  }

  /// Runs a sequence of the drive to its end.
  template <class T>
  Result<T> run(Task<Result<T>> task) {
    std::optional<Result<T>> result;
    spawn(world_.executor(), store(std::move(task), result), "test");
    if (!world_.run_until([&] { return result.has_value(); }, std::chrono::minutes(1)))
      return fail(Reason::internal, "it does not end");
    return std::move(*result);
  }
  /// Identifies and configures it.
  void bring_up() {
    const auto identity = run(drive_->identify(TransactionClass::parameters));
    ASSERT_TRUE(identity) << to_string(identity.error());
    const auto configured = run(drive_->configure());
    ASSERT_TRUE(configured) << to_string(configured.error());
    (void)drive_->take_eeprom_writes();
  }
  void cycle_power() {
    simulated_->set_power(false);
    nodes_.nodes().advance();
    world_.run_for(std::chrono::milliseconds(500));
    simulated_->set_power(true);
    nodes_.nodes().advance();
    world_.run_for(std::chrono::seconds(2));
  }

  [[nodiscard]] Drive& drive() { return *drive_; }
  [[nodiscard]] simulation::SimulatedCanNode& simulated() { return *simulated_; }
  [[nodiscard]] simulation::CanNodes& nodes() { return nodes_.nodes(); }
  [[nodiscard]] can::Network& network() { return network_; }
  [[nodiscard]] test::VirtualWorld& world() { return world_; }

 private:
  template <class T>
  static Task<> store(Task<Result<T>> task, std::optional<Result<T>>& result) {
    result = co_await std::move(task);
  }

  test::VirtualWorld world_;
  can::Network network_{world_.clock(), 1'000'000};
  simulation::NetworkNodes nodes_;
  simulation::SimulatedCanNode* simulated_ = nullptr;
  canopen::CanopenBus bus_;
  std::unique_ptr<Drive> drive_;
};

}  // namespace axisd::cia402
