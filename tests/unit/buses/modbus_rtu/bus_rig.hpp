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

/// Time that passes between two looks at it, as real time does.
class RestlessClock final : public Clock {
 public:
  explicit RestlessClock(VirtualClock& base) : base_(&base) {}
  [[nodiscard]] TimePoint now() const override { return base_->now() + Duration(++looks_); }
  [[nodiscard]] WallTime wall(TimePoint t) const override { return base_->wall(t); }

 private:
  void schedule(TimePoint when) override {
    timer_ = base_->call_at(when, [this] {
      const auto running = std::move(timer_);
      if (const auto next = run_due(now()); next != TimePoint::max()) schedule(next);
    });
  }
  VirtualClock* base_;
  mutable std::int64_t looks_ = 0;
  Timer timer_;
};

/// Two simulated drives, 1 and 2, on a line "a" in virtual time.
struct BusRig {
  VirtualWorld world;
  RestlessClock restless{world.clock()};
  VirtualLine* line = nullptr;
  std::unique_ptr<RtuBus> bus;
  std::map<std::string, Result<Answer>> results;

  explicit BusRig(bool is_restless = false) {
    auto made = std::make_unique<VirtualLine>(world, LineSettings{.name = "a", .port = "sim"});
    line = made.get();
    for (const std::uint8_t node : {1, 2})
      line->network().add(simulation::find_simulator("ykd2405pr")->make({.address = node}));
    Clock& clock = is_restless ? static_cast<Clock&>(restless) : world.clock();
    bus = std::make_unique<RtuBus>(world.executor(), clock, LineSettings{.name = "a", .port = "sim"},
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
