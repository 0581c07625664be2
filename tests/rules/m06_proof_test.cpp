// M6: what stands for the canary of a start: that canary was read just now, or the drive rests where no
// restarted one does.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <string>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "tests/rules/operate.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

constexpr std::uint16_t state = 0x0003, block = 0x0020, trigger = 0x0027;
constexpr auto guard = 100ms;

bool is_canary(const WireEntry& one) { return !one.is_write() && one.address() == block; }
bool is_state(const WireEntry& one) { return !one.is_write() && one.address() == state; }
bool is_block(const WireEntry& one) { return one.is_write() && one.address() == block; }

/// Moves to `target`; how many canaries were read for that until its block was written.
int canaries_of_start(Rig& rig, double target) {
  rig.line->forget_wire();
  const auto move = rig.complete(MoveAbsoluteRequest{.position = target});
  EXPECT_EQ(move.state, CommandState::done) << describe(move);
  EXPECT_NEAR(rig.load_mm(), target, 1e-9);
  EXPECT_EQ(rig.triggers(), 1);
  const auto& wire = rig.line->wire();
  const auto written = std::ranges::find_if(wire, is_block);
  EXPECT_NE(written, wire.end());
  return static_cast<int>(std::count_if(wire.begin(), written, is_canary));
}

/// Somebody else reads the drive's identity.
void ask_for_identity(Rig& rig) {
  auto ask = [](modbus_rtu::RtuBus& bus) -> Task<> {
    (void)co_await bus.transact({.node = 1, .address = 0x0000, .count = 2}, {.turnaround_max = 10ms});
  };
  spawn(rig.world.executor(), ask(*rig.machine->find_line("line-a")), "ask");
  rig.run(35ms);
}

void await_reading(Rig& rig) {
  const auto before = rig.state()->sampled.after();
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->sampled.after() != before; }, 1s));
}

TEST(M06, AReadingThatNoRestartedDriveShowsStandsForTheCanary) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    for (const double target : {20.0, 15.0, 15.01, 0.5})
      EXPECT_EQ(canaries_of_start(rig, target), 0) << target;
    ask_for_identity(rig);
    EXPECT_EQ(canaries_of_start(rig, 3), 0) << "an answer disturbs nothing";
  });
}

TEST(M06, AProofIsNotOlderThanTheGuard) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    double target = 10;
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = target}).state, CommandState::done);
    for (auto rest = 0ms; rest < 190ms; rest += 7ms) {  // not until it is read again
      SCOPED_TRACE(rest.count());
      rig.run(rest);
      target = target == 10 ? 12 : 10;
      const auto canaries = canaries_of_start(rig, target);
      if (rest > 80ms && rest < 90ms) EXPECT_EQ(canaries, 1) << "too little of the guard was left";
      EXPECT_LE(canaries, 1);
      // The newest proof on the wire; what was read before the command is not there any more.
      const auto& wire = rig.line->wire();
      const auto started = std::ranges::find_if(
          wire, [](const WireEntry& one) { return one.is_write() && one.address() == trigger; });
      ASSERT_NE(started, wire.end());
      const auto proof = std::find_if(std::make_reverse_iterator(started), wire.rend(),
                                      [](const auto& one) { return is_canary(one) || is_state(one); });
      if (proof == wire.rend())
        EXPECT_LT(rest, guard);
      else
        EXPECT_LE(started->begin - proof->begin, guard);
    }
  });
}

TEST(M06, WhatDisturbsTheNodeVoidsItsProof) {
  for (const auto kind : {FaultKind::corrupt_reply, FaultKind::truncate_reply, FaultKind::drop_reply}) {
    SCOPED_TRACE(to_string(kind));
    Rig rig;
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    rig.fault({.kind = kind, .register_address = 0x0000});
    ask_for_identity(rig);
    EXPECT_EQ(canaries_of_start(rig, 20), 1);
    EXPECT_EQ(canaries_of_start(rig, 10), 0) << "read since";
  }
}

TEST(M06, TheCounterOfARestartedDriveIsNoProof) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 0}).state, CommandState::done);
    await_reading(rig);
    EXPECT_EQ(canaries_of_start(rig, 5), 1);
  });
}

/// It is where the block sends the drive that a reading has to show, and not just any place but 0.
TEST(M06, ARestAnywhereElseIsNoProof) {
  Rig rig;
  rig.ready();
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 50});
  rig.run(200ms);
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);
  EXPECT_TRUE(move->has_ended());
  await_reading(rig);
  EXPECT_EQ(canaries_of_start(rig, 5), 1);
}

/// It may have sent a drive there that was restarted: Done rests on the canary, as the next start does.
TEST(M06, WhereATerminalMayMoveARestIsNoProof) {
  for (const bool by_terminal : {false, true}) {
    SCOPED_TRACE(by_terminal);
    Rig rig({.switches = {{"enabled_at_power_up", false}}, .adjust = [by_terminal](AxisSettings& axis) {
               if (by_terminal) axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
             }});
    rig.ready();
    rig.line->forget_wire();
    const auto move = rig.complete(MoveAbsoluteRequest{.position = 10});
    EXPECT_EQ(move.state, CommandState::done) << describe(move);
    const auto& wire = rig.line->wire();
    const auto started = std::ranges::find_if(
        wire, [](const WireEntry& one) { return one.is_write() && one.address() == trigger; });
    ASSERT_NE(started, wire.end());
    EXPECT_EQ(std::count_if(started, wire.end(), is_canary), by_terminal ? 1 : 0);
  }
}

/// It would be the next canary, and hide a restart meanwhile.
TEST(M06, ABlockThatHadToWaitIsNotWrittenOnAnOlderProof) {
  both_directions({}, [](const RigOptions& base) {
    auto options = base;
    options.adjust_drive = [](auto& node) { node.boot_time = 101ms; };
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    auto wait = [](modbus_rtu::RtuBus& bus) -> Task<> {
      (void)co_await bus.transact({.node = 9, .address = state},
                                  {.transaction_class = TransactionClass::stop, .turnaround_max = 400ms});
    };
    spawn(rig.world.executor(), wait(*rig.machine->find_line("line-a")), "wait");
    rig.run(3ms);
    ASSERT_EQ(rig.line->wire().back().node(), 9);
    rig.line->forget_wire();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 20});
    rig.run(1ms);
    rig.cycle_power();
    rig.run(3s);
    EXPECT_TRUE(move->has_ended());
    EXPECT_EQ(rig.load_mm(), 10);
    EXPECT_EQ(rig.triggers(), 0);
    EXPECT_EQ(move->value().cause->reason, Reason::rebooted) << describe(move->value());
    EXPECT_EQ(rig.state()->reboots, 1);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  });
}

TEST(M06, AfterSavingTheCanaryIsReadBeforeAStart) {
  Rig rig;
  rig.ready();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
  EXPECT_EQ(rig.complete(DisableRequest{}).state, CommandState::done);
  rig.line->forget_wire();
  const auto saved = operate<void>(rig, [](const DriveOperations& drive) { return drive.save_parameters(); });
  ASSERT_TRUE(saved) << to_string(saved.error());
  rig.enable();
  rig.complete(SetPositionRequest{.position = 10});
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 20}).state, CommandState::done);
  const auto& wire = rig.line->wire();
  const auto saving = std::ranges::find_if(
      wire, [](const WireEntry& one) { return one.is_write() && one.address() == 0x002B; });
  const auto started = std::ranges::find_if(
      wire, [](const WireEntry& one) { return one.is_write() && one.address() == trigger; });
  ASSERT_LT(saving, started);
  EXPECT_GE(std::count_if(saving, started, is_canary), 2) << "by the saving, and by the enable";
}

struct Cut {
  std::string model;
  bool enabled_at_power_up, one_frame, invert;
  Duration boot;
};

/// To and fro, each move as soon as the last is done, until the drive is switched off and on; and on.
void index_through_a_power_cut(const Cut& cut, Duration offset) {
  constexpr double near = 0.2, far = 0.4;
  RigOptions options{.invert = cut.invert,
                     .model = cut.model,
                     .switches = {{"enabled_at_power_up", cut.enabled_at_power_up}},
                     .adjust =
                         [&](AxisSettings& axis) {
                           axis.limits.acceleration_time = 20ms;
                           axis.model_settings["start_in_one_frame"] = cut.one_frame;
                           if (cut.model != "ykd2405pr") {
                             axis.homing.reset();
                             axis.inputs.clear();
                           }
                         },
                     .adjust_drive = [&](auto& node) { node.boot_time = cut.boot; }};
  Rig rig(options);
  rig.ready();
  const bool counted = cut.model == "ykd2405pr";
  const double window = counted ? 1e-9 : 0.15;  // a measured position: 10 pulses, and some noise
  const double lag = counted ? 1e-9 : 0.3;      // what the shaft is behind when the supply fails
  double target = near;
  CommandPtr move;
  const auto index = [&](Duration time) {
    for (const auto until = rig.world.now() + time; rig.world.now() < until;) {
      if (!move || move->has_ended()) {
        if (move && move->value().state == CommandState::done) EXPECT_NEAR(rig.load_mm(), target, window);
        target = target == near ? far : near;
        move = rig.try_submit(MoveAbsoluteRequest{.position = target}).value_or(nullptr);
      }
      rig.run_until([&] { return move && move->has_ended(); },
                    std::min<Duration>(until - rig.world.now(), 20ms));
    }
  };
  index(100ms + offset);
  rig.drive->advance(rig.world.now());
  rig.drive->set_power(false);
  const auto load = rig.load_mm();
  const auto starts = rig.drive->starts();
  index(1ms);
  rig.drive->advance(rig.world.now());
  rig.drive->set_power(true);
  index(4s);
  EXPECT_GE(load, -lag);
  EXPECT_LE(load, far + lag);
  EXPECT_NEAR(rig.load_mm(), load, lag) << "moved after the power cycle";
  EXPECT_EQ(rig.drive->starts(), starts);
  EXPECT_GE(rig.state()->reboots, 1);
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  EXPECT_EQ(rig.state()->link, LinkState::online);
}

class PowerCut : public ::testing::TestWithParam<Cut> {};

/// Around the reading at the target, Done, the next acceptance and its start: at each millisecond.
TEST_P(PowerCut, AtEachMillisecondOfIndexing) {
  for (auto offset = 0ms; offset < 60ms; offset += 1ms) {
    SCOPED_TRACE(offset.count());
    index_through_a_power_cut(GetParam(), offset);
  }
}

INSTANTIATE_TEST_SUITE_P(M06, PowerCut,
                         ::testing::Values(Cut{"ykd2405pr", true, false, false, 101ms},
                                           Cut{"ykd2405pr", false, false, true, 101ms},
                                           Cut{"ykd2405pr", true, true, true, 101ms},
                                           Cut{"ykd2405pr", true, false, false, 130ms},
                                           Cut{"ess42-r", true, false, false, 101ms}),
                         [](const auto& one) {
                           return std::string(one.param.model == "ess42-r" ? "ClosedLoop" : "OpenLoop") +
                                  (one.param.enabled_at_power_up ? "Energised" : "Released") +
                                  (one.param.one_frame ? "OneFrame" : "") +
                                  std::to_string(one.param.boot / 1ms);
                         });

}  // namespace
}  // namespace axisd::test
