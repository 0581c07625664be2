// Starting: canary, block, trigger, and what becomes of it: M6 to M8.
#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::Fault;
using simulation::FaultKind;

using Block = std::vector<std::uint16_t>;

/// Checks at every bind of a trigger what the drive would do with it. (One that boots does nothing.)
void watch_triggers(Rig& rig, Duration guard = 100ms, bool powered = true) {
  rig.line->set_on_bind([&rig, guard, powered](const WireEntry& entry) {
    if (!entry.is_write() || entry.address() != 0x0027) return;
    const auto& wire = rig.line->wire();  // ends with this entry
    ASSERT_GE(wire.size(), 3U);
    const auto& block = wire[wire.size() - 2];
    const auto& proof = wire[wire.size() - 3];
    EXPECT_EQ(block.function(), 0x10);
    EXPECT_EQ(block.address(), 0x0020);
    EXPECT_EQ(block.block().size(), 6U);
    EXPECT_EQ(proof.function(), 0x03);
    EXPECT_LE(entry.begin - proof.begin, guard);
    rig.drive->advance(entry.begin);
    // The canary, or a reading of the state that no restarted drive shows.
    const bool away_from_zero = rig.drive->peek(0x000A) != 0 || rig.drive->peek(0x000B) != 0;
    EXPECT_TRUE(proof.address() == 0x0020 || (proof.address() == 0x0003 && (away_from_zero || !powered)));
    for (std::uint16_t i = 0; powered && i < 6; ++i)
      EXPECT_EQ(rig.drive->peek(0x0020 + i), block.block()[i]) << "the drive would start with other values";
  });
}

TEST(M06, EachStartIsProofBlockTrigger) {
  for_each_switch({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    watch_triggers(rig);
    for (const double target : {10.0, 3.0, 7.5, 7.51, 0.0}) {
      const auto moved = rig.complete(MoveAbsoluteRequest{.position = target});
      EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
      EXPECT_NEAR(rig.load_mm(), target, 1e-9);
    }
    EXPECT_EQ(rig.writes_of(0x0027), 5);
    rig.run(100ms);
    const auto jog = rig.complete(JogRequest{.velocity = 20, .hold = 200ms});
    EXPECT_EQ(jog.cause->reason, Reason::expired) << describe(jog);
    EXPECT_EQ(rig.writes_of(0x0027), 6);
  });
}

TEST(M06, FactoryValuesAreNeverWritten) {
  // A move whose block would equal the drive's power-up contents: the canary would prove nothing.
  Rig rig({.adjust = [](AxisSettings& axis) { axis.limits.velocity = 200; }});
  rig.ready();
  const MotionValues with{.velocity = 10, .acceleration_time = 100ms, .deceleration_time = 100ms};
  rig.line->forget_wire();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 50, .with = with}).state, CommandState::done);
  EXPECT_EQ(rig.load_mm(), 50);
  const auto& block = rig.line->wire().at(rig.first_write(0x0020));
  EXPECT_NE(block.block(), (Block{5, 100, 100, 60, 0, 5000}));
  rig.cycle_power();
  rig.run(200ms);
  rig.reconnect();
  rig.run(2s);
  EXPECT_EQ(rig.state()->reboots, 1);
}

TEST(M07, PowerCycleBetweenTwoPollsThenAnIdenticalMove) {
  for_each_switch({}, [](const RigOptions& base) {
    auto options = base;
    options.adjust_drive = [](auto& node) { node.boot_time = 101ms; };
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 20}).state, CommandState::done);
    // Just after a poll: the next one is 200 ms away, and the drive is back before it.
    const auto before = rig.state()->sampled.after();
    rig.run_until([&] { return rig.state()->sampled.after() != before; }, 1s);
    rig.cycle_power();
    rig.run(110ms);
    rig.line->forget_wire();
    const auto starts = rig.drive->starts();
    const auto move = rig.submit(MoveRelativeRequest{.distance = 10});
    rig.run(3s);
    EXPECT_TRUE(move->has_ended());
    EXPECT_EQ(move->value().cause->reason, Reason::rebooted) << describe(move->value());
    EXPECT_EQ(rig.triggers(), 0);
    EXPECT_EQ(rig.drive->starts(), starts);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    EXPECT_EQ(rig.state()->reboots, 1);
    EXPECT_FALSE(rig.state()->enabled_by_us);
  });
}

/// A drive that was restarted shows the counter 0, and rests: a move to just there has nothing to do, but is
/// not done.
TEST(M10, PowerCycleThenAMoveToTheCountersZero) {
  both_directions({}, [](const RigOptions& base) {
    auto options = base;
    options.adjust_drive = [](auto& node) { node.boot_time = 101ms; };
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    rig.run_until(
        [&, checked = rig.state()->sampled.after()] { return rig.state()->sampled.after() != checked; }, 1s);
    rig.cycle_power();
    ASSERT_TRUE(rig.run_until([&] { return rig.state()->position == 0; }, 900ms)) << "noticed before";
    const auto move = rig.complete(MoveAbsoluteRequest{.position = 0});
    EXPECT_NE(move.state, CommandState::done);
    EXPECT_EQ(move.cause->reason, Reason::rebooted) << describe(move);
    EXPECT_EQ(rig.load_mm(), 10);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  });
}

/// Power fails at every millisecond of the chain and of the move itself. Whatever happens, the shaft is only
/// ever somewhere between the commanded ends, and Done means that it is there.
TEST(M07, PowerCycleAtEveryPointOfAStart) {
  both_directions({}, [](const RigOptions& base) {
    for (const auto boot : {101ms, 130ms, 300ms}) {
      for (int offset = 0; offset < 140; ++offset) {
        SCOPED_TRACE(offset);
        auto options = base;
        options.adjust_drive = [boot](auto& node) { node.boot_time = boot; };
        Rig rig(options);
        rig.ready();
        EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
        watch_triggers(rig, 100ms, false);
        const auto move = rig.submit(MoveAbsoluteRequest{.position = offset % 2 == 0 ? 0.0 : 5.0});
        rig.run(std::chrono::milliseconds(offset));
        rig.drive->advance(rig.world.now());
        const auto load = rig.load_mm();
        const bool was_done = move->value().state == CommandState::done;
        rig.cycle_power();
        rig.run(4s);
        EXPECT_TRUE(move->has_ended());
        EXPECT_FALSE(rig.drive->shaft_moving());
        EXPECT_GE(rig.load_mm(), -1e-9);
        EXPECT_LE(rig.load_mm(), 10 + 1e-9);
        EXPECT_NEAR(rig.load_mm(), load, 1e-9) << "moved after the power cycle";
        if (!was_done) EXPECT_NE(move->value().state, CommandState::done) << "not there: " << rig.load_mm();
        EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
        EXPECT_EQ(rig.state()->link, LinkState::online);
      }
    }
  });
}

TEST(M06, ATimeoutInTheChainRestartsIt) {
  for (const std::uint8_t function : {0x03, 0x10}) {
    for (const auto kind : {FaultKind::drop_request, FaultKind::drop_reply, FaultKind::corrupt_reply}) {
      Rig rig;
      rig.ready();
      watch_triggers(rig);
      rig.fault({.kind = kind, .function = function, .register_address = 0x0020});
      rig.line->forget_wire();
      const auto moved = rig.complete(MoveAbsoluteRequest{.position = 30});
      EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
      EXPECT_EQ(rig.triggers(), 1);
      EXPECT_EQ(rig.drive->starts(), 1);
    }
  }
}

/// It may have taken the shaft back to where it was, between two readings.
TEST(M08, AStandstillProvesNothingWhereATerminalStartsMotions) {
  for (const bool starts : {true, false}) {
    Rig rig({.switches = {{"enabled_at_power_up", false}}, .adjust = [starts](AxisSettings& axis) {
               if (starts) axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
             }});
    rig.ready();
    rig.fault({.kind = FaultKind::drop_request, .register_address = 0x0027});
    const auto move = rig.complete(MoveAbsoluteRequest{.position = 30});
    ASSERT_TRUE(move.cause);
    EXPECT_EQ(move.cause->outcome, starts ? Outcome::unknown : Outcome::not_executed) << describe(move);
  }
}

/// A pulse at a terminal ends a motion as it begins, between two readings: the drive rests, and did start.
TEST(M08, AStandstillProvesNothingWhereATerminalMayHaveEndedTheMotion) {
  for (const auto* function : {"motor_free", "stop", "quick_stop"}) {
    Rig rig({.model = "ess42-r",
             .adjust =
                 [function](AxisSettings& axis) {
                   axis.homing.reset();
                   axis.model_settings["released_position"] = std::string("counted");
                   axis.inputs = {{.terminal = "X3", .function = function}};
                 },
             .limits = false});
    rig.ready();
    rig.fault({.kind = FaultKind::drop_reply, .function = 0x06, .register_address = 0x0027});
    const auto move = rig.submit(MoveVelocityRequest{.velocity = 1});
    ASSERT_TRUE(rig.run_until([&] { return rig.drive->starts() == 1; }, 1s));
    rig.set_input("X3", true);
    rig.fault({.kind = FaultKind::drop_reply, .function = 0x03, .count = -1});
    rig.run(25ms);  // longer than the drive's filter, and not seen
    rig.set_input("X3", false);
    rig.run(5ms);
    rig.faults().clear();
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 5s));
    const auto& cause = move->value().cause;
    ASSERT_TRUE(cause) << function;
    EXPECT_NE(cause->outcome, Outcome::not_executed) << function << ": " << describe(move->value());
    EXPECT_FALSE(rig.drive->shaft_moving());
  }
}

TEST(M06, ChainThatNeverSucceedsIsAnErrorAndDoesNotMove) {
  Rig rig;
  rig.ready();
  rig.fault({.kind = FaultKind::drop_reply, .function = 0x10, .count = -1});
  const auto moved = rig.complete(MoveAbsoluteRequest{.position = 30});
  EXPECT_EQ(moved.state, CommandState::error) << describe(moved);
  EXPECT_EQ(moved.cause->outcome, Outcome::not_executed);
  EXPECT_EQ(rig.triggers(), 0);
  rig.faults().clear();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 30}).state, CommandState::done);
}

/// The block is the next canary: written over that of a drive which was restarted meanwhile, it would hide
/// the restart, and the move would go from a counter of 0.
TEST(M06, ABlockThatHadToWaitIsNotWrittenWithoutAnotherCanary) {
  both_directions({}, [](const RigOptions& base) {
    auto options = base;
    options.adjust_drive = [](auto& node) { node.boot_time = 101ms; };
    Rig rig(options);
    rig.ready();
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
    rig.run(85ms);  // so that the canary is read
    bool lost = false;
    auto wait = [](modbus_rtu::RtuBus& bus) -> Task<> {  // for nobody, before what is queued after it
      (void)co_await bus.transact({.node = 9, .address = 0x0003, .count = 1},
                                  {.transaction_class = TransactionClass::stop, .turnaround_max = 400ms});
    };
    rig.line->forget_wire();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 20});
    rig.line->set_on_bind([&](const WireEntry& entry) {
      if (entry.is_write() || entry.address() != 0x0020 || std::exchange(lost, true)) return;
      spawn(rig.world.executor(), wait(*rig.machine->find_line("line-a")), "wait");
    });
    ASSERT_TRUE(rig.run_until([&] { return rig.line->wire().size() > 1 && lost; }, 1s));
    ASSERT_EQ(rig.line->wire().back().node(), 9);
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

TEST(M06, RebootGuardExpiresTheTrigger) {
  // The block's reply is slow, so that the canary is too old when the trigger could be bound.
  Rig rig({.adjust = [](AxisSettings& axis) { axis.reboot_guard = 30ms; }});
  rig.ready();
  watch_triggers(rig, 30ms);
  rig.fault({.kind = FaultKind::delay_reply, .function = 0x10, .count = 2, .delay = 20ms});
  rig.line->forget_wire();
  const auto moved = rig.complete(MoveAbsoluteRequest{.position = 30});
  EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
  EXPECT_EQ(rig.writes_of(0x0020), 3);
  EXPECT_EQ(rig.triggers(), 1);

  rig.fault({.kind = FaultKind::delay_reply, .function = 0x10, .count = -1, .delay = 20ms});
  const auto never = rig.complete(MoveAbsoluteRequest{.position = 40});
  EXPECT_EQ(never.cause->reason, Reason::expired) << describe(never);
  EXPECT_EQ(rig.triggers(), 1);
}

/// The block of homing is part of the chain: it is no older than its trigger.
TEST(M06, RebootGuardExpiresTheBlockOfHoming) {
  constexpr std::uint16_t homing_mode = 0x0031, homing_speed = 0x0032;
  Rig rig({.adjust = [](AxisSettings& axis) { axis.reboot_guard = 30ms; }});
  rig.ready();
  rig.drive->poke(homing_speed, 77);  // so that it has to be written
  rig.fault({.kind = FaultKind::delay_reply, .function = 0x03, .count = -1, .delay = 13ms});
  rig.line->forget_wire();
  const auto home = rig.complete(HomeRequest{});
  ASSERT_TRUE(home.cause);
  EXPECT_EQ(home.cause->reason, Reason::expired) << describe(home);
  EXPECT_EQ(rig.writes_of(homing_mode), 0);
  EXPECT_EQ(rig.writes_of(0x0030), 0);
}

TEST(M07, TheCanaryIsReadEverySecond) {
  for (const auto idle :
       {1ms, 20ms, 100ms, 200ms, 333ms, 500ms, 700ms, 1000ms, 1200ms, 2000ms, 5000ms, 10000ms}) {
    Rig rig({.adjust = [idle](AxisSettings& axis) { axis.poll_idle = idle; }});
    rig.run(2s);
    rig.line->forget_wire();
    rig.run(10s);
    std::optional<TimePoint> last;
    int reads = 0;
    for (const auto& entry : rig.line->wire()) {
      if (entry.is_write() || entry.address() != 0x0020) continue;
      if (last) EXPECT_LE(entry.begin - *last, 1s) << "poll " << idle.count();
      last = entry.begin;
      ++reads;
    }
    EXPECT_GE(reads, 10);
    EXPECT_LE(reads, 15) << "no more often than needed, poll " << idle.count();
  }
}

TEST(M07, RebootBeforeEnableIsFoundByTheEnable) {
  Rig rig({.adjust_drive = [](auto& node) { node.boot_time = 101ms; }});
  rig.ready();
  rig.complete(DisableRequest{});
  rig.run(50ms);
  rig.cycle_power();
  rig.run(105ms);
  rig.line->forget_wire();
  const auto enable = rig.submit(EnableRequest{});
  rig.run(3s);
  EXPECT_EQ(enable->value().cause->reason, Reason::rebooted) << describe(enable->value());
  EXPECT_EQ(rig.writes_of(0x0029), 0);
}

TEST(M07, AfterARebootTheConfigurationIsAppliedAgain) {
  Rig rig;
  rig.ready();
  const auto input = rig.drive->peek(0x0044);
  rig.cycle_power();
  EXPECT_NE(rig.drive->peek(0x0044), input);
  rig.run(1s);
  rig.reconnect();
  rig.run(2s);
  EXPECT_EQ(rig.drive->peek(0x0044), input);
  EXPECT_EQ(rig.state()->link, LinkState::online);
  EXPECT_EQ(rig.triggers(), 0);
}

void one_lost_frame_of_the_trigger(bool homing) {
  for_each_switch({}, [homing](const RigOptions& options) {
    struct Case {
      FaultKind kind;
      bool executed;
    };
    for (const auto& [kind, executed] : {Case{FaultKind::drop_request, false},
                                         {FaultKind::drop_reply, true},
                                         {FaultKind::corrupt_reply, true},
                                         {FaultKind::truncate_reply, true},
                                         {FaultKind::delay_reply, true},
                                         {FaultKind::foreign_frame, true}}) {
      SCOPED_TRACE(to_string(kind));
      Rig rig(options);
      rig.ready();
      const std::uint16_t trigger = homing ? 0x0030 : 0x0027;
      rig.fault({.kind = kind, .register_address = trigger, .delay = 60ms});
      rig.line->forget_wire();
      const auto command =
          homing ? rig.complete(HomeRequest{}) : rig.complete(MoveAbsoluteRequest{.position = 30});
      EXPECT_EQ(rig.triggers(), 1);
      EXPECT_EQ(rig.drive->starts(), executed ? 1 : 0);
      if (executed) {
        EXPECT_EQ(command.state, CommandState::done) << describe(command);
      } else {
        EXPECT_EQ(command.state, CommandState::error);
        EXPECT_EQ(command.cause->outcome, Outcome::not_executed) << describe(command);
        rig.run(1s);
        EXPECT_GE(rig.writes_of(0x0028), 1) << "with a stop (M10)";
        EXPECT_EQ(rig.load_mm(), 0);
      }
      // What was unknown is settled: the next command works.
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
      const auto next = rig.complete(MoveRelativeRequest{.distance = 2});
      EXPECT_EQ(next.state, CommandState::done) << describe(next);
    }
  });
}

TEST(M08, OneLostFrameOfAMovesTrigger) { one_lost_frame_of_the_trigger(false); }
TEST(M08, OneLostFrameOfAHomingsTrigger) { one_lost_frame_of_the_trigger(true); }

TEST(M08, AShortMoveWithALostReplyIsStillSeen) {
  Rig rig;
  rig.ready();
  rig.fault({.kind = FaultKind::drop_reply, .register_address = 0x0027});
  const auto moved = rig.complete(MoveRelativeRequest{.distance = 0.01});  // one pulse
  EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
  EXPECT_EQ(rig.drive->starts(), 1);
  EXPECT_EQ(rig.load_mm(), 0.01);
}

TEST(M08, SilenceAfterTheTriggerIsUnknownAndNeedsAReset) {
  both_directions({}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    rig.fault({.kind = FaultKind::drop_reply, .register_address = 0x0027});
    rig.line->set_on_bind([&](const WireEntry& entry) {
      if (entry.is_write() && entry.address() == 0x0027)
        rig.fault({.kind = FaultKind::drop_reply, .count = -1});
    });
    const auto move = rig.complete(MoveAbsoluteRequest{.position = 30});
    EXPECT_EQ(move.state, CommandState::unknown) << describe(move);
    EXPECT_EQ(rig.try_submit(MoveAbsoluteRequest{.position = 30}).error().reason, Reason::fault);
    rig.faults().clear();
    rig.line->set_on_bind({});
    rig.line->forget_wire();
    rig.reconnect();
    EXPECT_EQ(rig.line->wire().empty() ? 0 : rig.line->wire().front().address(), 0x0028);
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    EXPECT_EQ(rig.complete(ResetRequest{}).state, CommandState::done);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 30}).state, CommandState::done);
    EXPECT_EQ(rig.load_mm(), 30);
  });
}

/// One accepted command moves at most once, and Done is never a lie: thousands of random fault patterns.
void one_command_moves_at_most_once(unsigned first_seed, unsigned last_seed) {
  constexpr FaultKind kinds[] = {
      FaultKind::drop_request,   FaultKind::drop_reply,    FaultKind::delay_reply,   FaultKind::corrupt_reply,
      FaultKind::truncate_reply, FaultKind::foreign_frame, FaultKind::reboot_before, FaultKind::reboot_after};
  int done = 0, moved_without_done = 0;
  for (unsigned seed = first_seed; seed <= last_seed; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    Rig rig({.invert = seed % 2 == 1, .adjust_drive = [&](auto& node) {
               node.boot_time = std::chrono::milliseconds(101 + pick(200));
             }});
    rig.ready();
    const int faults = 1 + pick(6);
    for (int i = 0; i < faults; ++i) {
      Fault fault{.kind = kinds[pick(pick(3) == 0 ? 8 : 6)],
                  .skip = pick(8),
                  .count = 1 + pick(4),
                  .delay = std::chrono::milliseconds(pick(80))};
      if (pick(2) == 0) fault.register_address = pick(2) == 0 ? 0x0027 : 0x0020;
      rig.fault(fault);
    }
    const double target = 1 + pick(20);
    const bool relative = pick(2) == 0;
    const auto command = relative ? rig.submit(MoveRelativeRequest{.distance = target})
                                  : rig.submit(MoveAbsoluteRequest{.position = target});
    rig.run_until([&] { return command->has_ended(); }, 30s);
    rig.faults().clear();
    rig.run(4s);
    ASSERT_TRUE(command->has_ended());
    ASSERT_LE(rig.drive->starts(), 1);
    ASSERT_FALSE(rig.drive->shaft_moving());
    ASSERT_GE(rig.load_mm(), 0);
    ASSERT_LE(rig.load_mm(), target + 1e-9);
    if (command->value().state == CommandState::done) {
      ASSERT_DOUBLE_EQ(rig.load_mm(), target);
      ASSERT_EQ(rig.drive->starts(), 1);
      ++done;
    } else if (rig.drive->starts() != 0) {
      ++moved_without_done;
    }
    if (command->value().cause && command->value().cause->outcome == Outcome::not_executed)
      ASSERT_EQ(rig.drive->starts(), 0) << describe(command->value());
    ASSERT_EQ(rig.state()->link, LinkState::online);
    if (rig.state()->trust != PositionTrust::unknown)
      ASSERT_NEAR(rig.state()->position, rig.load_mm(), 1e-9) << "trusted and wrong";
  }
  EXPECT_GT(done, 500);
  EXPECT_GT(moved_without_done, 25);
}

TEST(M08, OneCommandMovesAtMostOnce) { one_command_moves_at_most_once(1, 1500); }
TEST(M08, OneCommandMovesAtMostOnceMoreSeeds) { one_command_moves_at_most_once(1501, 3000); }

TEST(M08, LateStateReplyIsNotTakenForTheCanary) {
  int done = 0;
  for (int delay = 30; delay < 120; ++delay) {
    Rig rig;
    rig.ready();
    // The reply to a state read is late; reads of other registers follow. (10 registers against 6, and 9.)
    rig.fault({.kind = FaultKind::delay_reply,
               .function = 0x03,
               .count = 1 + delay % 3,
               .delay = std::chrono::milliseconds(delay)});
    rig.run(205ms);  // the first one strikes the reading at rest
    // Several late replies in a row look like a silent node for a while.
    rig.run_until([&] { return rig.state()->link == LinkState::online; }, 5s);
    const auto moved = rig.complete(MoveAbsoluteRequest{.position = 3});
    const bool was_done = moved.state == CommandState::done;
    done += was_done ? 1 : 0;
    // Three of them in a row are a drive that does not answer.
    if (!was_done) EXPECT_EQ(moved.cause->outcome, Outcome::not_executed) << delay << " " << describe(moved);
    rig.run(1s);
    EXPECT_EQ(rig.state()->reboots, 0);
    EXPECT_EQ(rig.drive->starts(), was_done ? 1 : 0);
  }
  EXPECT_GE(done, 60);
}

}  // namespace
}  // namespace axisd::test
