// A drive's EEPROM bears so many saves and no more: limits.eeprom_saves_per_day (M27).
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/rules/operate.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::uint16_t save_or_restore = 0x002B, x1_function = 0x0044, x2_function = 0x0045, filter = 0x0118,
                        current_loop = 0x0110;
constexpr std::uint64_t bound = 8;

Result<void> save(Rig& rig) {
  return operate<void>(rig, [](const DriveOperations& drive) { return drive.save_parameters(); });
}

Result<std::string> restore(Rig& rig) {
  return operate<std::string>(rig, [](const DriveOperations& drive) { return drive.restore_factory({}); });
}

Result<std::vector<ParameterValue>> write(Rig& rig, std::vector<ParameterValue> values) {
  return operate<std::vector<ParameterValue>>(
      rig, [values](const DriveOperations& drive) { return drive.write_parameters(values); });
}

RigOptions options(PersistSettings persist = {}, std::uint64_t saves_per_day = bound) {
  return {.adjust =
              [=](AxisSettings& axis) {
                axis.limits.eeprom_saves_per_day = saves_per_day;
                axis.persist = persist;
                axis.drift_check = 1s;
              },
          .persistence = true};
}

/// Saves until that is refused; how often it was not.
int save_all(Rig& rig) {
  int saves = 0;
  while (saves < 1000 && save(rig)) ++saves;
  return saves;
}

std::uint64_t kept(Rig& rig) { return rig.store.saved.axes["feeder"].eeprom.saves; }

TEST(M27, ADrivesEepromIsNotSavedToBeyondTheDaysBudget) {
  Rig rig(options());
  rig.complete(DisableRequest{});
  const auto at_start = kept(rig);
  EXPECT_LE(at_start, 1U) << "at most the switch that ends saving";
  EXPECT_EQ(save_all(rig), static_cast<int>(bound - at_start));
  EXPECT_EQ(kept(rig), bound);
  rig.line->forget_wire();
  const auto written = rig.drive->eeprom_writes();
  const auto refused = save(rig);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::eeprom_budget);
  EXPECT_EQ(refused.error().where.bus, "line-a");
  EXPECT_THAT(refused.error().message, HasSubstr("8 times in the last 24 h"));
  EXPECT_THAT(refused.error().remedy, HasSubstr("UTC"));
  EXPECT_EQ(restore(rig).error().reason, Reason::eeprom_budget);
  EXPECT_EQ(operate<std::string>(
                rig, [](const DriveOperations& drive) { return drive.change_serial({.node = 40}, {}); })
                .error()
                .reason,
            Reason::eeprom_budget);
  EXPECT_EQ(rig.writes_of(save_or_restore), 0);
  EXPECT_EQ(rig.drive->eeprom_writes(), written);
  EXPECT_EQ(rig.state()->link, LinkState::online) << "all else goes on";
  rig.ready();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 5}).state, CommandState::done);
}

TEST(M27, TheDaysBudgetOutlivesTheDaemonAndEndsWithTheDay) {
  Rig rig(options());
  rig.complete(DisableRequest{});
  save_all(rig);
  rig.stop_daemon();
  rig.start_daemon();
  EXPECT_EQ(save(rig).error().reason, Reason::eeprom_budget);
  rig.world.clock().set_wall_ahead(20h);
  EXPECT_FALSE(save(rig));
  rig.world.clock().set_wall_ahead(25h);
  EXPECT_EQ(save_all(rig), static_cast<int>(bound));
  EXPECT_GE(kept(rig), 2 * bound - 1) << "in all";
}

TEST(M27, AClockThatIsSetBackIsNotFoundInTheFutureAtEachStart) {
  Rig rig(options());
  rig.complete(DisableRequest{});
  rig.world.clock().set_wall_ahead(24h * 400);
  save_all(rig);
  rig.world.clock().set_wall_ahead(24h * 100);
  EXPECT_EQ(save(rig).error().reason, Reason::eeprom_budget) << "not unlocked";
  for (int start = 1; start <= 3; ++start) {
    rig.stop_daemon();
    rig.world.clock().set_wall_ahead(24h * 100 + 10h * start);
    rig.start_daemon();
    EXPECT_EQ(save(rig).has_value(), start == 3) << "not locked for ever: " << start;
  }
}

TEST(M27, ParametersThatTheDriveSavesAreAllWrittenOrNone) {
  Rig rig(options(PersistSettings::all(), 100));
  rig.complete(DisableRequest{});
  std::int64_t value = 10;
  const auto next = [&] { return ParameterValue{filter, value = value == 10 ? 12 : 10}; };
  for (int i = 0; i < 100 && kept(rig) < 99; ++i) {
    ASSERT_TRUE(write(rig, {next()})) << i;
    rig.run(1s);  // it is counted with the next reading
  }
  ASSERT_EQ(kept(rig), 99U);
  rig.line->forget_wire();
  EXPECT_EQ(write(rig, {next(), {current_loop, 700}}).error().reason, Reason::eeprom_budget);
  EXPECT_EQ(rig.writes_of(filter), 0);
  EXPECT_TRUE(write(rig, {{current_loop, 700}})) << "one more is permitted";
  EXPECT_FALSE(write(rig, {{current_loop, 701}}));
  EXPECT_TRUE(write(rig, {{current_loop, 700}})) << "nothing to be written";
  EXPECT_EQ(kept(rig), 100U);
}

/// Without `persist` nothing of this is saved, whatever the budget.
TEST(M27, WhatIsNotSavedIsNotBounded) {
  for_each_switch(options({}, 1), [](const RigOptions& each) {
    Rig rig(each);
    for (int i = 0; i < 5; ++i) {
      rig.complete(DisableRequest{});
      EXPECT_TRUE(write(rig, {{filter, 10 + i % 2}})) << i;
      const int seen = rig.state()->reboots;
      rig.cycle_power();
      EXPECT_TRUE(rig.run_until([&] { return rig.state()->reboots == seen + 1; }, 5s)) << i;
      rig.reconnect();
    }
  });
}

TEST(M27, AConfigurationBeyondTheBudgetIsNotSavedAndSaysSo) {
  for (const auto persist : {PersistSettings::all(), PersistSettings{.terminals = true}}) {
    auto of_this = options(persist, 2);
    of_this.connect = false;
    Rig rig(of_this);
    const auto refused = [&] {
      const auto state = rig.state();
      return state->link_error && state->link_error->reason == Reason::eeprom_budget;
    };
    ASSERT_TRUE(rig.run_until(refused, 10s));
    // Tried again and again, and nothing is written.
    const auto written = rig.drive->eeprom_writes();
    const auto counted = kept(rig);
    EXPECT_LE(counted, 3U) << "the bound, and the switch that ends saving";
    rig.run(60s);
    EXPECT_TRUE(refused());
    EXPECT_EQ(rig.state()->link, LinkState::configuring);
    EXPECT_EQ(rig.drive->eeprom_writes(), written);
    EXPECT_EQ(kept(rig), counted);
    const auto obstacles = rig.axis().explain(EnableRequest{}, {});
    const auto found = std::ranges::find(obstacles, Reason::eeprom_budget,
                                         [](const Obstacle& one) { return one.error.reason; });
    ASSERT_NE(found, obstacles.end());
    EXPECT_THAT(found->error.message, HasSubstr("feeder: not configured: not saved, to spare"));
    EXPECT_EQ(rig.try_submit(EnableRequest{}).error().reason, Reason::eeprom_budget);
    // Day by day the rest.
    int days = 0;
    for (; days < 60 && rig.state()->link != LinkState::online; ++days) {
      rig.world.clock().set_wall_ahead(25h * (days + 1));
      const auto before = kept(rig);
      rig.run(10s);
      EXPECT_LE(kept(rig) - before, 3U) << days;
    }
    EXPECT_EQ(rig.state()->link, LinkState::online) << days;
    EXPECT_GE(days, 1);
  }
}

/// To turn the switch of saving is a save, too, and so is what it is turned for.
TEST(M27, ABudgetThatIsTooSmallForTheSwitchAndASaveTurnsNoSwitch) {
  auto of_this = options({.terminals = true}, 1);
  of_this.connect = false;
  Rig rig(of_this);
  const auto refused = [&] {
    const auto state = rig.state();
    return state->link_error && state->link_error->reason == Reason::eeprom_budget;
  };
  ASSERT_TRUE(rig.run_until(refused, 10s));
  rig.run(10s);
  const auto counted = kept(rig);
  const auto written = rig.drive->eeprom_writes();
  for (int day = 1; day <= 3; ++day) {
    rig.world.clock().set_wall_ahead(25h * day);
    rig.run(10s);
    EXPECT_EQ(kept(rig), counted) << day;
    EXPECT_EQ(rig.drive->eeprom_writes(), written) << day;
  }
  EXPECT_THAT(rig.state()->link_error->remedy, HasSubstr("it takes 2 saves: raise limits"));
}

/// The switch of saving is turned before each write that is saved, and back: not for one that is not
/// permitted.
TEST(M27, WaitingForATerminalToOpenWearsNothing) {
  for (const bool saved : {false, true}) {
    auto of_this = options({.terminals = saved, .segments = !saved}, 100);
    of_this.connect = false;
    of_this.switches = {{"enabled_at_power_up", false}};
    of_this.adjust = [adjust = of_this.adjust](AxisSettings& axis) {
      adjust(axis);
      axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
    };
    of_this.before_start = [](simulation::SimulatedRtuNode& drive, VirtualWorld&) {
      drive.set_input("X4", true);
    };
    Rig rig(of_this);
    const auto waits = [&] {
      const auto state = rig.state();
      return state->link_error && state->link_error->reason == Reason::misconfigured;
    };
    ASSERT_TRUE(rig.run_until(waits, 10s));
    const auto counted = kept(rig);
    rig.run(60s);
    EXPECT_TRUE(waits());
    EXPECT_LE(kept(rig), counted + 1) << "the switch that ends saving";
    rig.set_input("X4", false);
    rig.reconnect();
  }
}

/// Two masters that want another terminal each would wear a drive out within hours.
TEST(M27, AStruggleForASavedTerminalEndsWithTheBudget) {
  Rig rig(options(PersistSettings::all(), 40));
  rig.complete(DisableRequest{});
  const auto others_write = [&] {
    rig.write_behind(x1_function, 0);
    rig.write_behind(x2_function, 0);
  };
  for (int i = 0; i < 200; ++i) {
    others_write();
    rig.run(3s);
  }
  EXPECT_EQ(kept(rig), 40U);
  EXPECT_EQ(rig.state()->link, LinkState::configuring);
  ASSERT_TRUE(rig.state()->link_error);
  EXPECT_EQ(rig.state()->link_error->reason, Reason::eeprom_budget);
  const auto written = rig.drive->eeprom_writes();
  rig.run(60s);
  EXPECT_EQ(rig.drive->eeprom_writes(), written);
}

}  // namespace
}  // namespace axisd::test
