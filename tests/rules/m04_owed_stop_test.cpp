// M4: what is known and told of a motion that nobody watched, and of the stop that is owed to it.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

template <class Content>
std::vector<Content> told(const Rig& rig) {
  std::vector<Content> all;
  for (const auto& event : rig.machine->events().events_after(0, 1000).events)
    if (const auto* content = std::get_if<Content>(&event.content)) all.push_back(*content);
  return all;
}

/// What was told of the drive while it was being connected, in all.
std::vector<std::string> found(const Rig& rig) {
  std::vector<std::string> details;
  for (auto& change : told<LinkChange>(rig))
    if (change.to == LinkState::configuring && !change.detail.empty())
      details.push_back(std::move(change.detail));
  return details;
}

/// For 400 ms: it was seen to move.
void run_at(Rig& rig, double velocity) {
  rig.submit(MoveVelocityRequest{.velocity = velocity});
  rig.run(400ms);
}

/// For longer than it takes to be noticed.
void cut_cable(Rig& rig) {
  rig.line->network().set_connected(false);
  rig.run(600ms);
}

void restore_cable(Rig& rig) {
  rig.line->network().set_connected(true);
  rig.reconnect();
  rig.run(2s);
}

TEST(M04, AMotionThatIsNotWatchedAnyMoreIsStillThatOfItsCommand) {
  for (const auto after : {50ms, 400ms}) {  // before and after it was seen
    Rig rig;
    rig.ready();
    rig.submit(MoveVelocityRequest{.velocity = 50});
    rig.run(after);
    cut_cable(rig);
    ASSERT_EQ(rig.state()->link, LinkState::offline);
    EXPECT_NE(rig.state()->motion_cause, MotionCause::unknown);
    restore_cable(rig);
    EXPECT_EQ(rig.state()->motion_cause, MotionCause::none);
    for (const auto& change : told<StateChange>(rig)) EXPECT_NE(change.cause, MotionCause::unknown);
  }
}

TEST(M04, SoIsOneWhoseStopWasNotConfirmed) {
  Rig rig;
  rig.ready();
  run_at(rig, 20);
  rig.fault({.kind = simulation::FaultKind::drop_request, .register_address = 0x0028, .count = -1});
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::error);
  ASSERT_TRUE(rig.state()->moving);
  EXPECT_EQ(rig.state()->motion_cause, MotionCause::command);
  rig.faults().clear();
  rig.run(5s);
  EXPECT_EQ(rig.state()->motion_cause, MotionCause::none);
}

TEST(M04, SoIsOneThatAnEarlierDaemonBegan) {
  Rig rig({.persistence = true, .journal = true});
  rig.ready();
  rig.submit(MoveVelocityRequest{.velocity = 50}, {.client = "c", .request_id = "r"});
  rig.run(400ms);
  rig.kill_daemon();
  rig.start_daemon();
  rig.run(5s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  for (const auto& change : told<StateChange>(rig)) EXPECT_NE(change.cause, MotionCause::unknown);
}

TEST(M04, AMotionOfNobodyIsNotOurs) {
  Rig rig;
  rig.ready();
  run_at(rig, 50);
  rig.complete(StopRequest{});
  rig.write_behind(0x0023, 100);
  rig.write_behind(0x0027, 2);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->motion_cause == MotionCause::unknown; }, 2s));
}

/// What runs by a terminal is not the command's that was cut off before.
TEST(M04, AMotionThatATerminalTookOverIsNotOurs) {
  Rig rig({.switches = {{"enabled_at_power_up", false}}, .adjust = [](AxisSettings& axis) {
             axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
           }});
  rig.ready();
  run_at(rig, 20);
  cut_cable(rig);
  rig.set_input("X4", true);
  rig.run(100ms);
  rig.line->network().set_connected(true);
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link != LinkState::offline; }, 5s));
  rig.run(2s);
  EXPECT_NE(rig.state()->motion_cause, MotionCause::command);
}

TEST(M04, AnOwedStopThatCameThroughIsTold) {
  Rig rig;
  rig.ready();
  EXPECT_EQ(found(rig), std::vector<std::string>{});
  run_at(rig, 50);
  cut_cable(rig);
  restore_cable(rig);
  EXPECT_FALSE(rig.drive->shaft_moving());
  const std::vector<std::string> once{"the stop that was owed to it was sent, and it came to rest"};
  EXPECT_EQ(found(rig), once);
  cut_cable(rig);
  restore_cable(rig);
  EXPECT_EQ(found(rig), once) << "it rested before";
}

/// A drive falls silent while it is being configured, and is stopped, twice: as soon as it is heard again the
/// stop goes out, and not what its configuration had still to read.
TEST(M04, AStopThatIsOwedGoesBeforeTheRestOfAConfiguration) {
  constexpr std::uint16_t canary = 0x0020, stop = 0x0028;
  constexpr auto pause = 100ms;  // it is still being configured
  for (int skipped = 0; skipped < 4; ++skipped) {
    SCOPED_TRACE(skipped);
    Rig rig;
    rig.cycle_power(10ms);
    bool configures = false, silent = false;
    int read = 0;
    rig.line->set_on_bind([&](const WireEntry& entry) {
      configures = configures || (entry.is_write() && entry.address() == canary);
      if (!configures || entry.is_write() || silent || read++ < skipped) return;
      rig.line->network().set_connected(false);
      silent = true;
    });
    ASSERT_TRUE(rig.run_until([&] { return silent; }, 5s));
    rig.line->set_on_bind({});
    ASSERT_EQ(rig.state()->link, LinkState::configuring);
    rig.run(pause);
    for (int i = 0; i < 2; ++i) {
      rig.submit(StopRequest{});
      rig.run(pause);
    }
    rig.line->forget_wire();
    rig.line->network().set_connected(true);
    const auto answered = [&] {
      return std::ranges::count(rig.line->wire(), modbus_rtu::ExchangeStatus::replied, &WireEntry::status);
    };
    ASSERT_TRUE(rig.run_until([&] { return answered() > 1; }, 5s));
    const auto& wire = rig.line->wire();
    const auto first = std::ranges::find(wire, modbus_rtu::ExchangeStatus::replied, &WireEntry::status);
    const auto is_stop = [](const WireEntry& entry) { return entry.is_write() && entry.address() == stop; };
    EXPECT_TRUE(is_stop(*first) || is_stop(*std::next(first)))
        << std::hex << first->address() << ", then " << std::next(first)->address();
    rig.reconnect();
  }
}

/// The drive goes on as its daemon left it, and the next one is told to stop all before it knows its port.
std::vector<Result<CommandPtr>> stopped_at_start(Rig& rig, bool runs, bool unplugged) {
  rig.ready();
  if (runs) run_at(rig, 50);
  rig.kill_daemon();
  rig.unplugged = unplugged;
  rig.start_daemon(false);
  return rig.machine->stop_all("hmi");
}

void expect_held_at_rest(Rig& rig) {
  rig.reconnect();
  rig.run(2s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  EXPECT_EQ(rig.triggers(), 0);
  EXPECT_NE(rig.state()->state, AxisState::error_stop);
  EXPECT_FALSE(rig.state()->fault);
  ASSERT_NE(rig.machine->inhibited_by(), nullptr);
  const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::inhibited);
}

TEST(M04, AStopBeforeThePortIsOpenIsSentOnceItIs) {
  for (const bool runs : {false, true}) {
    Rig rig({.limits = false});
    const auto stops = stopped_at_start(rig, runs, false);
    ASSERT_TRUE(stops.at(0));
    const auto& stop = *stops[0];
    EXPECT_FALSE(stop->has_ended()) << "nobody knows yet";
    ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 10s));
    EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
    EXPECT_FALSE(rig.drive->shaft_moving()) << "told stopped, and moves";
    EXPECT_GE(rig.writes_of(0x0028), 1);
    expect_held_at_rest(rig);
  }
}

TEST(M04, AStopForAPortThatIsNotThereIsOwedUntilItIs) {
  for (const bool runs : {false, true}) {
    Rig rig({.limits = false});
    const auto stops = stopped_at_start(rig, runs, true);
    ASSERT_TRUE(stops.at(0));
    const auto& stop = *stops[0];
    ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 3s));
    EXPECT_EQ(stop->value().state, CommandState::unknown) << "nothing was stopped";
    rig.run(3s);
    EXPECT_EQ(rig.state()->link, LinkState::offline);
    EXPECT_TRUE(rig.line->wire().empty());
    rig.line->set_open(true);
    ASSERT_TRUE(rig.run_until([&] { return !rig.line->wire().empty(); }, 5s));
    EXPECT_EQ(rig.line->wire().front().address(), 0x0028) << "the first frame is the stop";
    EXPECT_TRUE(rig.line->wire().front().is_write());
    expect_held_at_rest(rig);
  }
}

TEST(M04, AStopForADriveThatHasNotBootedYetIsOwedToIt) {
  Rig rig({.limits = false});
  rig.ready();
  rig.kill_daemon();
  rig.drive->set_power(false);
  rig.start_daemon(false);
  const auto stops = rig.machine->stop_all("hmi");
  ASSERT_TRUE(stops.at(0));
  const auto& stop = *stops[0];
  ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 5s));
  EXPECT_EQ(stop->value().state, CommandState::unknown) << "nobody answered";
  EXPECT_GE(rig.writes_of(0x0028), 1);
  EXPECT_NE(rig.state()->state, AxisState::error_stop);
  rig.run(2s);
  rig.drive->advance(rig.world.now());
  rig.drive->set_power(true);
  rig.line->forget_wire();
  expect_held_at_rest(rig);
  EXPECT_GE(rig.writes_of(0x0028), 1) << "it is owed still";
}

TEST(M04, OfADriveThatWasHeardAnUnknownStopIsAFault) {
  Rig rig({.limits = false});
  rig.ready();
  cut_cable(rig);
  const auto stop = rig.submit(StopRequest{});
  ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 5s));
  EXPECT_EQ(stop->value().state, CommandState::unknown);
  restore_cable(rig);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
}

TEST(M04, ADriveThatGoesOnUnderTheStopThatWasOwedSinceTheStartIsNotAtRest) {
  Rig rig({.limits = false});
  const auto stops = stopped_at_start(rig, true, true);
  rig.run(1s);
  rig.fault({.kind = simulation::FaultKind::drop_request, .register_address = 0x0028, .count = -1});
  rig.line->set_open(true);
  rig.run(5s);
  EXPECT_NE(rig.state()->link, LinkState::online);
  rig.faults().clear();
  expect_held_at_rest(rig);
}

}  // namespace
}  // namespace axisd::test
