// Exactness and trust: M19 and M20.
#include <gtest/gtest.h>

#include <cmath>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

RigOptions rotary() {
  return {.adjust =
              [](AxisSettings& axis) {
                axis.scale = {.pulses_per_revolution = 4000,
                              .travel_numerator = 360,
                              .invert = axis.scale.invert,
                              .modulo = 360,
                              .unit = "deg"};
                axis.limits.position_minimum.reset();
                axis.limits.position_maximum.reset();
                axis.limits.velocity = 18000;
                axis.homing.reset();
                axis.poll_moving = 20s;  // the long way takes hours
                axis.inputs.clear();
              },
          .adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.mechanics = {}; }};
}

TEST(M19, TenThousandIndexingsOfAThird) {
  both_directions({.adjust =
                       [](AxisSettings& axis) {
                         axis.scale = {.pulses_per_revolution = 200,
                                       .gear_motor = 1,
                                       .gear_output = 1,
                                       .travel_numerator = 100,
                                       .invert = axis.scale.invert,
                                       .unit = "mm"};  // 2 pulses per mm: a third is never whole
                         axis.limits = {.velocity = 3000, .acceleration_time = 0ms, .start_speed_rpm = 300};
                         axis.homing.reset();
                         axis.inputs.clear();
                       },
                   .adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.mechanics = {}; }},
                  [](const RigOptions& options) {
                    Rig rig(options);
                    rig.ready();
                    const auto rest = [&](int count) {
                      for (int i = 0; i < count; ++i) {
                        const auto command = rig.submit(MoveRelativeRequest{.distance = 1.0 / 3});
                        ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 5s));
                        ASSERT_EQ(command->value().state, CommandState::done) << describe(command->value());
                        if (rig.line->wire().size() > 1000) rig.line->forget_wire();
                      }
                    };
                    rest(10'000);
                    const auto exact = std::llround(10'000 * (1.0 / 3) * 2);
                    EXPECT_EQ(std::abs(rig.drive->shaft_pulses()), exact);
                  });
}

TEST(M19, ARefusedMoveIsNotTheBaseOfTheNext) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 100});
    rig.run(200ms);
    EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = 5000}));
    EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = 300, .with = {.velocity = 1e9}}));
    EXPECT_FALSE(rig.try_submit(MoveRelativeRequest{.distance = 50}));
    rig.run_until([&] { return move->has_ended(); }, 10s);
    EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 10}).state, CommandState::done);
    EXPECT_EQ(rig.load_mm(), 110);
  });
}

TEST(M19, TheBaseAfterAStopIsWhereItIs) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 100});
  rig.run(500ms);
  rig.complete(StopRequest{});
  const auto here = rig.load_mm();
  rig.complete(MoveRelativeRequest{.distance = 1});
  EXPECT_NEAR(rig.load_mm(), here + 1, 1e-9);
}

/// The counter is zeroed at standstill before a target could leave 32 bit, whatever is lost meanwhile.
TEST(M19, EndlessAxesRezeroAtStandstill) {
  for (const std::optional<FaultKind> fault : {std::optional<FaultKind>{},
                                               {FaultKind::drop_request},
                                               {FaultKind::drop_reply},
                                               {FaultKind::corrupt_reply}}) {
    for (int offset = 0; offset < 2; ++offset) {
      both_directions(rotary(), [&](const RigOptions& options) {
        Rig rig(options);
        rig.ready();
        // 2^30 - 500 pulses in one move.
        const double nearly = ((1 << 30) - 500) / 4000.0 * 360;
        const auto far =
            rig.complete(MoveRelativeRequest{.distance = nearly, .with = {.velocity = 18000}}, 100h);
        ASSERT_EQ(far.state, CommandState::done) << describe(far);
        const auto before = rig.drive->shaft_pulses();
        if (fault) rig.fault({.kind = *fault, .register_address = 0x002C});
        rig.run(150ms + std::chrono::milliseconds(offset) * 2 +
                std::chrono::microseconds(300 * offset % 1700));
        const auto move = rig.complete(MoveRelativeRequest{.distance = 360});
        if (!fault) EXPECT_EQ(move.state, CommandState::done) << describe(move);
        EXPECT_EQ(rig.writes_of(0x002C), 1);
        const auto turn = options.invert ? -4000 : 4000;
        EXPECT_EQ(rig.drive->shaft_pulses(), move.state == CommandState::done ? before + turn : before);
        rig.run(1s);
        const auto truth =
            static_cast<double>(rig.drive->shaft_pulses()) * (options.invert ? -1 : 1) / 4000 * 360;
        if (rig.state()->trust != PositionTrust::unknown)
          EXPECT_NEAR(std::remainder(rig.state()->position - truth, 360), 0, 1e-3) << "trusted and wrong";
      });
      if (fault) break;
    }
  }
}

/// What waits was planned before the counter was zeroed.
TEST(M19, BufferedMovesGoOnOverARezeroedCounter) {
  both_directions(rotary(), [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const double nearly = ((1 << 30) - 500) / 4000.0 * 360;
    ASSERT_EQ(rig.complete(MoveRelativeRequest{.distance = nearly, .with = {.velocity = 18000}}, 100h).state,
              CommandState::done);
    const auto before = rig.drive->shaft_pulses();
    rig.submit(MoveRelativeRequest{.distance = 360});
    rig.submit(MoveRelativeRequest{.distance = 120}, {.buffer_mode = BufferMode::buffered});
    const auto last = rig.submit(MoveRelativeRequest{.distance = 240}, {.buffer_mode = BufferMode::buffered});
    rig.run_until([&] { return last->has_ended(); }, 60s);
    EXPECT_EQ(last->value().state, CommandState::done) << describe(last->value());
    EXPECT_EQ(rig.writes_of(0x002C), 1);
    EXPECT_EQ(rig.drive->shaft_pulses(), before + (options.invert ? -8000 : 8000));
  });
}

TEST(M19, TheCounterMayWrap) {
  both_directions(rotary(), [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const double velocity = 18000;  // 200 kHz: 2^31 pulses take 3 h
    const auto run = rig.submit(MoveVelocityRequest{.velocity = velocity});
    while (std::abs(rig.drive->shaft_pulses()) < (1LL << 31) + 10000 && !run->has_ended()) {
      rig.run(30s);
      rig.line->forget_wire();
      if (rig.world.now() > TimePoint(60h)) break;
    }
    EXPECT_FALSE(run->has_ended());
    rig.complete(StopRequest{});
    const auto truth =
        static_cast<double>(rig.drive->shaft_pulses()) * (options.invert ? -1 : 1) / 4000 * 360;
    EXPECT_NEAR(std::remainder(rig.state()->position - truth, 360), 0, 1e-3);
    const auto before = rig.drive->shaft_pulses();
    const auto move = rig.complete(MoveRelativeRequest{.distance = 360});
    EXPECT_EQ(move.state, CommandState::done) << describe(move);
    EXPECT_EQ(std::abs(rig.drive->shaft_pulses() - before), 4000);
  });
}

TEST(M19, ModuloTakesTheShorterWay) {
  both_directions(rotary(), [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto turned = [&] {
      return static_cast<double>(rig.drive->shaft_pulses()) * (options.invert ? -1 : 1) * 0.09;
    };
    struct Step {
      double target, turned;
    };
    for (const auto& [target, expected] :
         {Step{90, 90}, {350, -10}, {10, 10}, {180, 180}, {0.36, 0.36}, {359.64, -0.36}, {720, 0}}) {
      const auto moved = rig.complete(MoveAbsoluteRequest{.position = target});
      EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
      EXPECT_NEAR(turned(), expected, 0.046) << target;  // half a pulse
      EXPECT_GE(rig.state()->position, 0);
      EXPECT_LT(rig.state()->position, 360);
    }
  });
}

TEST(M20, WaysToLoseTrust) {
  struct Way {
    const char* name;
    std::function<void(Rig&)> lose;
  };
  const Way ways[] = {
      {"quick stop", [](Rig& rig) { rig.complete(StopRequest{.kind = StopKind::quick_stop}); }},
      {"disable", [](Rig& rig) { rig.complete(DisableRequest{}); }},
      {"alarm",
       [](Rig& rig) {
         rig.drive->raise_alarm(2);
         rig.run(1s);
       }},
      {"reboot",
       [](Rig& rig) {
         rig.cycle_power();
         rig.run(2s);
       }},
      {"released",
       [](Rig& rig) {
         rig.write_behind(0x0029, 0);
         rig.run(1s);
       }},
      {"homing begun",
       [](Rig& rig) {
         rig.submit(HomeRequest{});
         rig.run(200ms);
       }},
      {"limit while halting",
       [](Rig& rig) {
         rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.deceleration_time = 1500ms}});
         rig.run(1s);
         rig.submit(StopRequest{.kind = StopKind::halt});
         rig.run(100ms);
         rig.set_input("X1", true);
         rig.run(2s);
       }},
  };
  for (const auto& way : ways) {
    SCOPED_TRACE(way.name);
    for_each_switch({.persistence = true}, [&](const RigOptions& options) {
      Rig rig(options);
      rig.ready();
      EXPECT_EQ(rig.state()->trust, PositionTrust::set);
      EXPECT_TRUE(rig.store.saved.axes["feeder"].offset);
      way.lose(rig);
      EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
      const auto& kept = rig.store.saved.axes["feeder"].offset;  // that the drive was restarted, too (M1)
      EXPECT_TRUE(!kept || kept->trust == PositionTrust::unknown) << "a restart would restore it";
      EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = 1}));
    });
  }
}

TEST(M20, AMoveAcceptedWhileHaltingDoesNotOutliveTheTrust) {
  Rig rig;
  rig.ready();
  rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.deceleration_time = 1500ms}});
  rig.run(1s);
  const auto back = rig.submit(MoveAbsoluteRequest{.position = 10});
  rig.run(100ms);
  rig.set_input("X1", true);
  rig.run(5s);
  EXPECT_EQ(back->value().state, CommandState::error) << describe(back->value());
  EXPECT_EQ(back->value().cause->reason, Reason::not_trusted);
  EXPECT_EQ(rig.drive->starts(), 1);
}

TEST(M20, RestoredOnlyWithProvenContinuity) {
  struct Case {
    const char* name;
    std::function<void(Rig&)> meanwhile;
    bool restored;
  };
  const Case cases[] = {
      {"nothing", [](Rig&) {}, true},
      {"power cycle",
       [](Rig& rig) {
         rig.cycle_power();
         rig.idle(1s);
       },
       false},
      {"moved by another",
       [](Rig& rig) {
         rig.write_behind(0x0027, 2);
         rig.idle(300ms);
         rig.write_behind(0x0028, 1);
         rig.idle(300ms);
       },
       false},
      {"released", [](Rig& rig) { rig.write_behind(0x0029, 0); }, false},
      {"rewritten", [](Rig& rig) { rig.write_behind(0x0021, 77); }, false},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    for_each_switch({.persistence = true}, [&](const RigOptions& options) {
      for (const double position : {0.0, 12.34}) {
        Rig rig(options);
        rig.enable();
        rig.complete(SetPositionRequest{.position = 5});
        rig.complete(MoveAbsoluteRequest{.position = 5 + position});
        rig.run(500ms);
        rig.stop_daemon();
        rig.idle(2s);
        c.meanwhile(rig);
        rig.start_daemon();
        EXPECT_EQ(rig.state()->trust, c.restored ? PositionTrust::restored : PositionTrust::unknown);
        if (c.restored) EXPECT_NEAR(rig.state()->position, 5 + position, 1e-9);
        EXPECT_EQ(rig.triggers(), 0);
        // Once more: what was not proven then is not proven by chance now.
        rig.run(1s);
        rig.stop_daemon();
        rig.idle(1s);
        rig.start_daemon();
        EXPECT_EQ(rig.state()->trust, c.restored ? PositionTrust::restored : PositionTrust::unknown)
            << "twice";
        if (c.restored) EXPECT_NEAR(rig.state()->position, 5 + position, 1e-9);
      }
    });
  }
}

TEST(M20, ARecordThatFailedOnceIsVoidForEver) {
  Rig rig({.switches = {{"enabled_at_power_up", true}}, .persistence = true});
  rig.ready();
  rig.run(500ms);
  rig.stop_daemon();
  rig.start_daemon();  // restored; the record has the neutral block now, at counter 0
  EXPECT_EQ(rig.state()->trust, PositionTrust::restored);
  rig.stop_daemon();
  rig.cycle_power();
  rig.idle(1s);
  rig.start_daemon();  // not restored, but writes that same neutral block
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  rig.stop_daemon();
  rig.start_daemon();
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown) << "a power cycle was forgotten";
}

/// The canary is replaced when a drive is configured: written over that of one that was restarted since it
/// was read, it would hide the restart, and the record would be taken for true at a counter of 0.
TEST(M20, ARestartWhileTheCanaryIsBeingReplacedIsNoProof) {
  Rig rig({.switches = {{"enabled_at_power_up", true}},
           .adjust_drive = [](auto& node) { node.boot_time = 101ms; },
           .persistence = true});
  rig.ready();
  rig.complete(MoveAbsoluteRequest{.position = 10});
  rig.run(500ms);
  rig.stop_daemon();
  rig.start_daemon(false);
  auto wait = [](modbus_rtu::RtuBus& bus) -> Task<> {  // for nobody, before what is queued after it
    (void)co_await bus.transact({.node = 9, .address = 0x0003, .count = 1},
                                {.transaction_class = TransactionClass::stop, .turnaround_max = 400ms});
  };
  int canaries_read = 0;
  rig.line->set_on_bind([&](const WireEntry& entry) {
    if (entry.is_write() || entry.address() != 0x0020 || ++canaries_read != 2)
      return;  // the first is the proof
    spawn(rig.world.executor(), wait(*rig.machine->find_line("line-a")), "wait");
  });
  ASSERT_TRUE(
      rig.run_until([&] { return !rig.line->wire().empty() && rig.line->wire().back().node() == 9; }, 5s));
  EXPECT_EQ(rig.writes_of(0x0020), 0) << "not yet replaced";
  rig.cycle_power();
  rig.run(5s);
  EXPECT_EQ(rig.state()->link, LinkState::online);
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
}

TEST(M20, WithoutStorageThereIsNoSetPosition) {
  Rig rig({.persistence = true});
  rig.enable();
  rig.store.failing = true;
  const auto set = rig.complete(SetPositionRequest{.position = 5});
  EXPECT_EQ(set.state, CommandState::error);
  EXPECT_EQ(set.cause->reason, Reason::storage);
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = 1}));
}

TEST(M20, TrustIsKeptOverACableCutAtRest) {
  Rig rig;
  rig.ready();
  rig.line->network().set_connected(false);
  rig.run(3s);
  rig.line->network().set_connected(true);
  rig.reconnect();
  EXPECT_EQ(rig.state()->trust, PositionTrust::set);
}

}  // namespace
}  // namespace axisd::test
