// M15: what was computed beside what happens to real axes on one line.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "config/budget.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/cia402/configuration.hpp"
#include "devices/simulation/simulator.hpp"
#include "devices/yss_c/model.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view file = R"(
machine: m15
buses:
  line-a: { modbus_rtu: { port: sim, baud: 38400, turnaround_max: 8 ms } }
axes:
  a1: { bus: line-a, node: 1, model: ykd2405pr, unit: mm, scale: { microstep: 1600 pulses/rev, travel: 5 mm/rev },
        limits: { velocity: 50 mm/s, acceleration_time: 50 ms } }
  a2: { bus: line-a, node: 2, model: ssd2608pr, unit: mm, scale: { microstep: 1600 pulses/rev, travel: 5 mm/rev },
        limits: { velocity: 50 mm/s, acceleration_time: 50 ms } }
  a3: { bus: line-a, node: 3, model: ess42-r, unit: mm, scale: { microstep: 1600 pulses/rev, travel: 5 mm/rev },
        limits: { velocity: 50 mm/s, acceleration_time: 50 ms } }
  off: { bus: line-a, node: 4, model: ykd2405pr, unit: mm, scale: { microstep: 1600 pulses/rev, travel: 5 mm/rev },
        limits: { velocity: 50 mm/s, acceleration_time: 50 ms } }
)";

/// Three axes of three models, and a fourth whose drive has no power.
class Budget : public testing::Test {
 protected:
  Budget() {
    auto loaded = config::load_text(file, "m15.yaml");
    EXPECT_TRUE(loaded.configuration) << (loaded.diagnostics.empty() ? "" : to_string(loaded.diagnostics[0]));
    const auto& configuration = *loaded.configuration;
    machine_ = std::make_unique<core::MachineCore>(
        core::MachineParts{.executor = world_.executor(),
                           .clock = &world_.clock(),
                           .instance_id = "t",
                           .make_line =
                               [this](const modbus_rtu::LineSettings& settings) {
                                 auto made = std::make_unique<VirtualLine>(world_, settings);
                                 line_ = made.get();
                                 return made;
                               },
                           .budgets = config::budgets(configuration)},
        configuration);
    for (const auto& [axis, simulation] : configuration.axes)
      line_->network().add(simulation::find_simulator(axis.model)
                               ->make({.address = axis.node, .powered = axis.name != "off"}));
    line_->network().advance(world_.now());
    line_->set_on_bind([this](const WireEntry&) {
      // Some replies come nearly as late as they may.
      line_->network().faults().clear();
      if (random_() % 2 == 0)
        line_->network().faults().add({.kind = simulation::FaultKind::delay_reply, .delay = 5ms});
    });
    machine_->start();
    world_.run_for(5s);
  }
  ~Budget() override {
    machine_->close();
    EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, 60s));
  }

  void complete(const std::string& axis, const Action& action) {
    const auto command = machine_->submit(
        axis, action, {.client = "t", .request_id = std::to_string(++requests_), .arrived = world_.now()});
    ASSERT_TRUE(command) << axis << ": " << to_string(command.error());
    EXPECT_TRUE(world_.run_until([&] { return (*command)->has_ended() || is_endless(action); }, 30s)) << axis;
  }
  static bool is_endless(const Action& action) { return std::holds_alternative<MoveVelocityRequest>(action); }
  void run_all() {
    for (const auto* axis : moving_) complete(axis, MoveVelocityRequest{.velocity = 40});
    world_.run_for(std::chrono::milliseconds(1000 + random_() % 400));
  }

  static constexpr const char* moving_[] = {"a1", "a2", "a3"};
  VirtualWorld world_;
  VirtualLine* line_ = nullptr;
  std::unique_ptr<core::MachineCore> machine_;
  std::mt19937 random_{15};
  int requests_ = 0;
};

TEST_F(Budget, NothingTakesLongerThanPredicted) {
  for (const auto* axis : moving_) complete(axis, EnableRequest{});
  for (int round = 0; round < 8; ++round) {
    run_all();
    for (const auto* axis : moving_) complete(axis, StopRequest{});
    run_all();
    (void)machine_->stop_all("t", world_.now());
    world_.run_for(2s);
    for (const auto* axis : moving_) EXPECT_TRUE(machine_->find(axis)->at_rest()) << axis;
    machine_->release_inhibit("t", [](const Result<void>& done) { EXPECT_TRUE(done); });
  }
  const auto report = machine_->budgets().at(0);
  ASSERT_EQ(report.axes.size(), 4U);
  for (const auto& axis : report.axes) {
    const auto& [predicted, deceleration, unit, way_alone, way_all, seen] = axis;
    const auto& name = predicted.axis;
    EXPECT_LE(seen.refresh_idle, predicted.refresh_idle) << name;
    EXPECT_LE(seen.refresh_moving, predicted.refresh_moving_all) << name;
    EXPECT_LE(seen.stop_frame, predicted.alone.last_frame) << name;
    EXPECT_LE(seen.standstill, predicted.alone.standstill + deceleration) << name;
    EXPECT_LE(seen.stop_frame_all, predicted.all.last_frame) << name;
    EXPECT_LE(seen.standstill_all, predicted.all.standstill + deceleration) << name;
    const bool off = name == "off";
    for (const auto time :
         {seen.refresh_idle, seen.refresh_moving, seen.stop_frame, seen.standstill, seen.standstill_all})
      EXPECT_EQ(time == Duration{}, off) << name;
    EXPECT_GT(seen.stop_frame_all, Duration{}) << name << ": it went out to all, answered or not";
  }
}

TEST_F(Budget, ModelsAskNoMoreThanTheySay) {
  line_->forget_wire();
  for (const auto* axis : moving_) complete(axis, EnableRequest{});
  run_all();
  for (const auto* axis : moving_) complete(axis, StopRequest{});
  world_.run_for(15s);
  int states = 0, canaries = 0, stops = 0;
  for (const auto& entry : line_->wire()) {
    const auto model = machine_->axes().at(entry.node() - 1U)->settings().model;
    const auto& set = find_drive_model(model)->rtu_transactions;
    const auto count = entry.function() == 0x03 ? entry.value() : std::uint16_t{0};
    const ExchangeSize size{.request = static_cast<std::uint16_t>(entry.request.size()),
                            .reply = count > 0 ? reading(count).reply : std::uint16_t{8}};
    EXPECT_LE(size.request + size.reply, set.longest.request + set.longest.reply) << model;
    if (entry.function() == 0x03 && entry.address() == 0x0003) {
      EXPECT_EQ(size, set.state) << model;
      ++states;
    }
    if (entry.function() == 0x03 && entry.address() == 0x0020) {
      EXPECT_EQ(size, set.continuity) << model;
      ++canaries;
    }
    if (entry.is_write() && entry.address() == 0x0028) {
      EXPECT_EQ(size, set.stop) << model;
      ++stops;
    }
  }
  EXPECT_GT(states, 100);
  EXPECT_GT(canaries, 30);
  EXPECT_EQ(stops, 3);
}

TEST(BudgetOfModels, WhatTheYssCSaysIsWhatItsDriverAsks) {
  const auto& said = yss_c::descriptor().can_transactions;
  const auto asked = cia402::transactions_of(yss_c::model(), said.drift_transfers);
  EXPECT_EQ(said.state_pdos, asked.state_pdos);
  EXPECT_EQ(said.pdo_inhibit, asked.pdo_inhibit);
  EXPECT_EQ(said.pdo_event, asked.pdo_event);
  EXPECT_EQ(said.state_transfers, asked.state_transfers);
  EXPECT_EQ(said.continuity_transfers, asked.continuity_transfers);
  EXPECT_EQ(said.stop_transfers, asked.stop_transfers);
  // Everything that may be set, and the EEPROM switch.
  const auto required = cia402::required_objects(yss_c::model(), {.pulses_per_revolution = 1600});
  ASSERT_TRUE(required);
  EXPECT_LE(required->size() + 1 + yss_c::descriptor().settings.size(), said.drift_transfers);
}

}  // namespace
}  // namespace axisd::test
