// A bus on a virtual line with simulated drives.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::modbus_rtu::test {

using namespace axisd::test;

/// Two simulated drives, 1 and 2, on a line "a" in virtual time.
struct BusRig {
  VirtualWorld world;
  VirtualLine* line = nullptr;
  std::unique_ptr<RtuBus> bus;
  std::map<std::string, Result<Answer>> results;

  BusRig() {
    auto made = std::make_unique<VirtualLine>(world, LineSettings{.name = "a", .port = "sim"});
    line = made.get();
    for (const std::uint8_t node : {1, 2})
      line->network().add(simulation::find_simulator("ykd2405pr")->make({.address = node}));
    bus = std::make_unique<RtuBus>(world.executor(), world.clock(), LineSettings{.name = "a", .port = "sim"},
                                   std::move(made));
    bus->start();
    world.run_for(std::chrono::milliseconds(10));
  }
  ~BusRig() { world.run_for(std::chrono::seconds(2)); }

  void transact(std::string name, Request request, TransactionOptions options = {}) {
    auto one = [](BusRig& rig, std::string key, Request r, TransactionOptions o) -> Task<> {
      auto result = co_await rig.bus->transact(std::move(r), std::move(o));
      rig.results.insert_or_assign(std::move(key), std::move(result));
    };
    spawn(world.executor(), one(*this, std::move(name), std::move(request), std::move(options)), "test");
  }
  void read(std::string name, std::uint16_t address, std::uint16_t count, std::uint8_t node = 1) {
    transact(
        std::move(name),
        {.node = node, .function = Function::read_holding_registers, .address = address, .count = count});
  }
};

}  // namespace axisd::modbus_rtu::test
