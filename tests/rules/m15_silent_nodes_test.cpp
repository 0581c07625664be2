// What nodes that do not answer cost the others of their line, and how soon the end of a motion is told.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "buses/modbus_rtu/quarantine.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "tests/rules/shared_line.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr int count = 16;

bool is_silent(int node, int silent) { return node > count - silent; }

/// Sixteen axes polled as fast as the line can; returns the lowest of the rates that the answering ones keep,
/// as parts of those they have when all answer. Also checks what silence costs in all: 2 % of the line per
/// node, or 4 % of it in all where a node would be found too late else.
double rate_kept(int silent, int baud) {
  SharedLine line(count, baud, [](AxisSettings& axis) { axis.poll_idle = 1ms; });
  const auto silence = modbus_rtu::silence(modbus_rtu::SerialSettings{.baud = baud});
  const auto online = [&] {
    return line.all([](const AxisSnapshot& axis) { return axis.link == LinkState::online; });
  };
  EXPECT_TRUE(line.world.run_until(online, 60s));
  const auto replies = [&] {
    line.line->forget_wire();
    line.world.run_for(30s);
    std::map<int, int> by_node;
    Duration in_vain{};
    for (const auto& entry : line.line->wire()) {
      if (entry.status == modbus_rtu::ExchangeStatus::replied) ++by_node[entry.node()];
      if (entry.status == modbus_rtu::ExchangeStatus::timeout) in_vain += entry.end - entry.begin + silence;
    }
    return std::pair(by_node, in_vain);
  };
  const auto before = replies().first;
  for (int node = 1; node <= count; ++node)
    if (is_silent(node, silent)) line.line->network().node(static_cast<std::uint8_t>(node))->set_power(false);
  line.world.run_for(10s);
  const auto [after, in_vain] = replies();
  EXPECT_LE(in_vain, 30'000ms * std::max(40, 21 * silent) / 1000) << silent << " silent";
  EXPECT_GE(in_vain, 30'000ms * 10 * silent / 1000) << "they are probed all the same";
  double lowest = 10;
  for (int node = 1; node <= count - silent; ++node)
    lowest = std::min(lowest, static_cast<double>(after.at(node)) / before.at(node));
  // They are found again.
  for (int node = 1; node <= count; ++node)
    if (is_silent(node, silent)) line.line->network().node(static_cast<std::uint8_t>(node))->set_power(true);
  EXPECT_TRUE(line.world.run_until(
      [&] { return line.all([](const AxisSnapshot& axis) { return axis.link != LinkState::offline; }); },
      4s));
  EXPECT_TRUE(line.world.run_until(online, 30s));
  return lowest;
}

TEST(M15, OneSilentNodeOfSixteenLeavesTheOthersTheirRate) {
  for (const int baud : {115200, 19200}) EXPECT_GE(rate_kept(1, baud), 0.95) << baud;
}
TEST(M15, ThreeSilentNodesOfSixteenLeaveTheOthersTheirRate) {
  for (const int baud : {115200, 19200}) EXPECT_GE(rate_kept(3, baud), 0.90) << baud;
}

/// The longer a wait in vain, the seldomer a node is probed: but not so seldom that nobody would wait for it.
TEST(M15, ANodeThatMayAnswerLateIsFoundAgainInTime) {
  SharedLine line(4, 115200, [](AxisSettings& axis) { axis.turnaround_max = 200ms; });
  const auto all_are = [&](LinkState link) {
    return line.world.run_until(
        [&] {
          return line.all([&](const AxisSnapshot& axis) { return axis.link == link || axis.name != "a4"; });
        },
        10s);
  };
  ASSERT_TRUE(all_are(LinkState::online));
  line.line->network().node(4)->set_power(false);
  line.world.run_for(60s);
  line.line->forget_wire();
  line.world.run_for(30s);
  Duration in_vain{};
  for (const auto& entry : line.line->wire())
    if (entry.node() == 4) in_vain += entry.end - entry.begin + 1750us;
  EXPECT_LE(in_vain, 30'000ms * 4 / 100);
  EXPECT_GE(in_vain, 200ms) << "each in vain";
  line.line->network().node(4)->set_power(true);
  const auto back = line.world.now();
  ASSERT_TRUE(all_are(LinkState::online));
  EXPECT_LE(line.world.now() - back, 6s);
}

TEST(M15, AxesThatAreOfflineAtStartDoNotDelayTheOthers) {
  SharedLine line(count, 115200);
  for (const std::uint8_t node : {1, 2, 3, 4}) line.line->network().node(node)->set_power(false);
  EXPECT_TRUE(line.world.run_until(
      [&] {
        return std::ranges::count_if(line.machine().axes(), [](const auto& axis) {
                 return axis->snapshot()->link == LinkState::online;
               }) == count - 4;
      },
      10s));
}

/// Each axis gets its first stop at once; what is repeated to those that do not answer waits (M4, M15).
TEST(M15, RepeatedStopsToSilentNodesCostLittle) {
  SharedLine line(count, 115200);
  ASSERT_TRUE(line.world.run_until(
      [&] { return line.all([](const AxisSnapshot& axis) { return axis.link == LinkState::online; }); },
      20s));
  const auto enabled = line.submit(16, EnableRequest{});
  ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 5s));
  line.submit(16, MoveVelocityRequest{.velocity = 20});
  line.world.run_for(1s);
  line.line->network().faults().add({.kind = simulation::FaultKind::drop_request, .node = 16, .count = -1});
  line.world.run_for(10s);
  line.line->forget_wire();
  const auto asked = line.world.now();
  const auto stop = line.submit(16, StopRequest{});
  line.world.run_for(20s);
  const auto& wire = line.line->wire();
  const auto first = std::ranges::find_if(
      wire, [](const WireEntry& entry) { return entry.node() == 16 && entry.address() == 0x0028; });
  ASSERT_NE(first, wire.end());
  EXPECT_LE(first->begin - asked, 45ms) << "the first attempt is never held back";
  const auto frame = modbus_rtu::wire_time(modbus_rtu::SerialSettings{.baud = 115200}, first->request.size());
  EXPECT_EQ(line.machine().find("a16")->observed().stop_frame, first->begin + frame - asked)
      << "answered or not";
  const auto cost = [&wire] {
    Duration in_vain{};
    int stops = 0;
    for (const auto& entry : wire) {
      if (entry.node() == 16) in_vain += entry.end - entry.begin + 1750us;
      stops += entry.node() == 16 && entry.address() == 0x0028 ? 1 : 0;
    }
    EXPECT_GE(stops, 5) << "it stays owed";
    return in_vain;
  };
  EXPECT_LE(cost(), 20'000ms / modbus_rtu::quarantine_owed_share) << "its motor may be turning";
  line.world.run_for(15s);
  line.line->forget_wire();
  line.world.run_for(20s);
  EXPECT_LE(cost(), 20'000ms * 2 / 100) << "it does not come back";
  line.line->network().faults().clear();
  ASSERT_TRUE(line.world.run_until([&] { return !line.line->network().node(16)->shaft_moving(); }, 5s));
}

/// A motor that turned when its node fell silent is stopped soon after it is there again, however long it was
/// away; and the others are read as published all that time.
TEST(M15, AStopThatIsOwedComesSoonAndCostsTheOthersNoMoreThanPublished) {
  for (const int baud : {115200, 19200})
    for (auto silence = 1000ms; silence < 8s; silence = silence * 3 / 2) {
      SCOPED_TRACE(testing::Message() << baud << " Bd, silent for " << silence.count() << " ms");
      SharedLine line(8, baud);
      ASSERT_TRUE(line.world.run_until(
          [&] { return line.all([](const AxisSnapshot& axis) { return axis.link == LinkState::online; }); },
          20s));
      for (int axis = 1; axis <= 8; ++axis) {
        const auto enabled = line.submit(axis, EnableRequest{});
        ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 5s));
        line.submit(axis, MoveVelocityRequest{.velocity = 20});
      }
      line.world.run_for(1s);
      line.line->network().faults().add(
          {.kind = simulation::FaultKind::drop_request, .node = 8, .count = -1});
      line.world.run_for(silence);
      line.line->network().faults().clear();
      line.line->forget_wire();
      const auto back = line.world.now();
      const auto answered = [&] {
        return std::ranges::find_if(line.line->wire(), [](const WireEntry& entry) {
          return entry.node() == 8 && entry.address() == 0x0028 &&
                 entry.status == modbus_rtu::ExchangeStatus::replied;
        });
      };
      ASSERT_TRUE(line.world.run_until([&] { return answered() != line.line->wire().end(); }, 5s));
      EXPECT_LE(answered()->begin - back, 500ms);
      line.world.run_for(1s);
      const auto report = line.machine().budgets().at(0);
      for (const auto& axis : report.axes)
        EXPECT_LE(axis.observed.refresh_moving, axis.predicted.refresh_moving_all) << axis.predicted.axis;
    }
}

/// A stop that is asked for while an earlier one's frame waits in vain gets a frame of its own.
TEST(M13, AStopToASilentNodeIsNotTakenForTheOneBefore) {
  SharedLine line(1, 115200);
  const auto link_is = [&](LinkState link) {
    return line.world.run_until(
        [&] { return line.all([&](const AxisSnapshot& axis) { return axis.link == link; }); }, 20s);
  };
  ASSERT_TRUE(link_is(LinkState::online));
  line.line->network().node(1)->set_power(false);
  ASSERT_TRUE(link_is(LinkState::offline));
  for (const auto within : {1ms, 5ms, 10ms, 15ms, 20ms, 25ms}) {
    line.world.run_for(5s);
    line.line->forget_wire();
    const auto sent = [&] {
      return std::ranges::any_of(line.line->wire(),
                                 [](const auto& entry) { return entry.address() == 0x0028; });
    };
    line.submit(1, StopRequest{});
    ASSERT_TRUE(line.world.run_until(sent, 1s));
    line.world.run_for(within);
    line.line->forget_wire();
    const auto second = line.submit(1, StopRequest{});
    ASSERT_TRUE(line.world.run_until([&] { return second->has_ended(); }, 1s));
    EXPECT_TRUE(sent()) << within.count() << " ms after the first";
  }
}

/// The look at the standstill of an axis that is not online is held back where the node answers no reading;
/// the next stop is not.
TEST(M15, AFurtherStopDoesNotWaitForALookThatIsHeldBack) {
  SharedLine line(2, 115200);
  ASSERT_TRUE(line.world.run_until(
      [&] { return line.all([](const AxisSnapshot& axis) { return axis.link == LinkState::online; }); },
      20s));
  line.line->network().faults().add(
      {.kind = simulation::FaultKind::drop_request, .node = 1, .function = 3, .count = -1});
  ASSERT_TRUE(line.world.run_until(
      [&] { return line.machine().find("a1")->snapshot()->link == LinkState::offline; }, 20s));
  for (auto after = 10ms; after < 400ms; after += 13ms) {
    line.world.run_for(3s);
    line.submit(1, StopRequest{});
    line.world.run_for(after);
    line.line->forget_wire();
    const auto asked = line.world.now();
    line.submit(1, StopRequest{});
    line.world.run_for(1s);
    const auto& wire = line.line->wire();
    const auto stop = std::ranges::find_if(
        wire, [](const WireEntry& entry) { return entry.node() == 1 && entry.address() == 0x0028; });
    ASSERT_NE(stop, wire.end()) << after.count();
    EXPECT_LE(stop->begin - asked, 50ms) << after.count() << " ms after the first";
  }
}

/// What is owed does not wait for its turn once anything is heard of the node.
TEST(M4, AnOwedStopFollowsTheFirstReplyAtOnce) {
  SharedLine line(2, 115200);
  ASSERT_TRUE(line.world.run_until(
      [&] { return line.all([](const AxisSnapshot& axis) { return axis.link == LinkState::online; }); },
      20s));
  const auto enabled = line.submit(2, EnableRequest{});
  ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 5s));
  line.submit(2, MoveVelocityRequest{.velocity = 20});
  line.world.run_for(1s);
  auto& faults = line.line->network().faults();
  faults.add({.kind = simulation::FaultKind::drop_request, .node = 2, .count = -1});
  line.world.run_for(30s);
  auto look = [](modbus_rtu::RtuBus& bus) -> Task<> {
    (void)co_await bus.transact({.node = 2, .count = 1}, {.transaction_class = TransactionClass::scan});
  };
  int earlier = 0;  // looked for just before its turn
  for (int round = 0; round < 20; ++round) {
    line.world.run_for(std::chrono::milliseconds(1000 + 83 * round));
    faults.clear();
    line.line->forget_wire();
    spawn(line.world.executor(), look(*line.machine().find_line("line-a")), "look");
    line.world.run_for(150ms);
    std::vector<std::uint16_t> asked;
    for (const auto& entry : line.line->wire())
      if (entry.node() == 2) asked.push_back(entry.address());
    ASSERT_GE(asked.size(), 2U) << round;
    // The owed stop, or one attempt of it was under way when the node came back, and went first.
    if (asked[0] == 0x0028) ++earlier;
    EXPECT_TRUE(asked[0] == 0x0028 || asked[1] == 0x0028) << round;
    line.world.run_for(5s);
    EXPECT_FALSE(line.line->network().node(2)->shaft_moving()) << round;
    if (round == 19) break;
    ASSERT_TRUE(line.world.run_until(
        [&] { return line.all([](const AxisSnapshot& axis) { return axis.link == LinkState::online; }); },
        20s));
    line.submit(2, ResetRequest{});
    line.world.run_for(1s);
    line.submit(2, MoveVelocityRequest{.velocity = 20});
    line.world.run_for(1s);
    faults.add({.kind = simulation::FaultKind::drop_request, .node = 2, .count = -1});
    line.world.run_for(20s);
  }
  EXPECT_LE(earlier, 5);
}

/// From the true end of a move, by the simulator, to its Done; also of one that is too short for its
/// velocity.
TEST(M10, DoneIsToldAtOnce) {
  Duration latest{};
  for (int length = 1; length <= 40; ++length) {
    Rig rig;
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = static_cast<double>(length)});
    ASSERT_TRUE(rig.run_until(
        [&] {
          rig.drive->advance(rig.world.now());
          return rig.drive->shaft_moving();
        },
        1s));
    std::optional<TimePoint> ended;
    while (!move->has_ended() && rig.world.now().time_since_epoch() < 2h) {
      rig.run(200us);
      rig.drive->advance(rig.world.now());
      if (!ended && !rig.drive->shaft_moving()) ended = rig.world.now();
    }
    ASSERT_EQ(move->value().state, CommandState::done) << describe(move->value());
    latest = std::max(latest, rig.world.now() - *ended);
  }
  ::testing::Test::RecordProperty("latest_us", std::to_string(latest / 1us));
  EXPECT_LE(latest, 12ms) << "two readings of the state";
}

}  // namespace
}  // namespace axisd::test
