// A common start on a bus whose nodes the test plays: order of the frames, and what may follow a failure.
#include "buses/canopen/common_start.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "buses/canopen/canopen_bus.hpp"
#include "network.hpp"

namespace axisd::canopen {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr auto settled = CanopenBus::Readiness::settled;

/// Nodes 5, 6, ...; each is armed with 1Fh on 300h + node and neutralised with 10Fh.
struct Start {
  explicit Start(Duration period = 10ms, std::uint8_t members = 2) : count(members) {
    auto made = std::make_unique<FakePort>(world);
    port = made.get();
    bus =
        std::make_unique<CanopenBus>(world.executor(), world.clock(),
                                     NetworkSettings{.name = "can0", .sync_period = period}, std::move(made));
    bus->start();
    for (std::uint8_t i = 0; i < count; ++i) EXPECT_TRUE(bus->attach(node(i), {}));
    port->set_link(can::InterfaceState::up);
    for (std::uint8_t i = 0; i < count; ++i) bus->set_readiness(node(i), settled);
  }
  ~Start() {
    world.run_for(1s);
    bus->close();
  }
  static std::uint8_t node(std::uint8_t i) { return static_cast<std::uint8_t>(5 + i); }

  std::vector<SyncStart> members() {
    std::vector<SyncStart> all;
    for (std::uint8_t i = 0; i < count; ++i) {
      gates.push_back(std::make_shared<AxisGate>());
      all.push_back({.node = node(i),
                     .cob_id = 0x300U + node(i),
                     .arm = {0x1F, 0},
                     .guards = {{.gate = gates.back(), .epoch = gates.back()->epoch()}},
                     .neutral = [] { return Bytes{0x0F, 1}; },
                     .confirm = [this, i]() -> Task<Result<void>> {
                       if (on_confirm) on_confirm(i);
                       if (deaf.contains(i)) co_return fail(Reason::no_reply, "silent");
                       co_return Result<void>{};
                     }});
    }
    return all;
  }
  void launch() {
    const auto store = [](Start& self, std::vector<SyncStart> all) -> Task<> {
      self.result = co_await self.bus->start_together(std::move(all), self.not_before);
    };
    result.reset();
    spawn(world.executor(), store(*this, members()), "test");
  }
  Result<TimePoint> finish() {
    EXPECT_TRUE(world.run_until([this] { return result.has_value(); }, 10s));
    return *result;
  }
  Result<TimePoint> run() {
    launch();
    return finish();
  }
  [[nodiscard]] long syncs() const { return std::ranges::count(port->log, "080#"); }

  VirtualWorld world;
  FakePort* port = nullptr;
  std::unique_ptr<CanopenBus> bus;
  std::uint8_t count;
  std::vector<std::shared_ptr<AxisGate>> gates;
  std::set<std::uint8_t> deaf;
  std::function<void(std::uint8_t)> on_confirm;
  TimePoint not_before{};
  std::optional<Result<TimePoint>> result;
};

TEST(CommonStart, ArmsAllThenSendsOneSync) {
  Start start(Duration{});
  const auto began = start.world.now();
  const auto at = start.run();
  ASSERT_TRUE(at);
  EXPECT_THAT(start.port->log, ElementsAre("305#1F00", "306#1F00", "080#"));
  EXPECT_EQ(*at, start.port->times.back());
  EXPECT_EQ(*at - began, 200us);
  start.world.run_for(1s);
  EXPECT_EQ(start.syncs(), 1) << "no period: no cycles";
}

TEST(CommonStart, CyclesGoOnAtTheirTimesAndNoneComesBetween) {
  Start start(10ms, 16);
  start.world.run_for(109'500us);
  const auto first = start.port->times.front();
  start.port->log.clear();
  start.port->frame_time = 1ms;  // so that a cycle falls between
  const auto at = start.run();
  ASSERT_TRUE(at);
  EXPECT_EQ(start.port->log.size(), 17U);
  EXPECT_EQ(start.port->log.back(), "080#");
  start.port->frame_time = 100us;
  start.port->times.clear();
  start.world.run_for(100ms);
  ASSERT_GE(start.port->times.size(), 9U);
  for (const auto time : start.port->times) {
    EXPECT_EQ((time - first) % 10ms, 0us);
    EXPECT_GE(time - *at, 5ms);
  }
  EXPECT_EQ(start.bus->master().sync().counters().missed, 0U);
}

TEST(CommonStart, TheSyncComesAtItsMomentAndNodesAreArmedShortlyBefore) {
  Start start(10ms);
  start.world.run_for(25ms);
  start.port->log.clear();
  start.port->times.clear();
  start.not_before = start.world.now() + 43ms;
  start.launch();
  start.world.run_for(36ms);
  EXPECT_THAT(start.port->log, ElementsAre("080#", "080#", "080#", "080#")) << "cycles go on until then";
  start.port->log.clear();
  start.port->times.clear();
  const auto at = start.finish();
  ASSERT_TRUE(at);
  EXPECT_THAT(start.port->log, ElementsAre("305#1F00", "306#1F00", "080#"));
  EXPECT_EQ(*at, start.not_before + 100us) << "the frame takes its time";
  EXPECT_GE(start.port->times.front(), start.not_before - 5ms);
}

TEST(CommonStart, NoCycleComesBetweenArmingAndTheMoment) {
  Start start(10ms);
  start.world.run_for(25ms);
  start.not_before = start.world.now() + 47ms;  // a cycle would come 2 ms before
  start.launch();
  start.world.run_for(36ms);
  start.port->log.clear();
  ASSERT_TRUE(start.finish());
  EXPECT_THAT(start.port->log, ElementsAre("305#1F00", "306#1F00", "080#"));
}

TEST(CommonStart, AStopBetweenArmingAndTheMomentStartsNobody) {
  Start start(10ms);
  start.not_before = start.world.now() + 20ms;
  start.launch();
  start.world.run_for(18ms);
  ASSERT_TRUE(start.bus->armed(5));
  start.gates.front()->raise();
  const auto result = start.finish();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().reason, Reason::superseded);
  EXPECT_NE(result.error().outcome, Outcome::unknown);
  start.world.run_for(100ms);
  EXPECT_EQ(start.port->log.back(), "306#0F01") << "neutralised, and no cycle before they are settled";
}

TEST(CommonStart, WaitsForASyncThatIsOnItsWay) {
  Start start(10ms);
  start.world.run_for(10ms);  // a cycle begins now, and ends 100 us later
  EXPECT_TRUE(start.port->log.empty());
  ASSERT_TRUE(start.run());
  EXPECT_THAT(start.port->log, ElementsAre("080#", "305#1F00", "306#1F00", "080#"));
}

TEST(CommonStart, RefusedWhileANodeMayHoldSomething) {
  Start start;
  start.bus->set_readiness(6, CanopenBus::Readiness::unknown);
  const auto refused = start.run();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("node 6"));
  EXPECT_EQ(refused.error().outcome, Outcome::not_executed);
  start.world.run_for(100ms);
  EXPECT_TRUE(start.port->log.empty());
}

TEST(CommonStart, RefusedWhereSomethingElseSendsSync) {
  Start start(Duration{});
  start.port->receive(0x080, Bytes{});
  EXPECT_EQ(start.run().error().reason, Reason::misconfigured);
  EXPECT_TRUE(start.port->log.empty());
  start.world.run_for(1s);
  EXPECT_TRUE(start.run());
}

/// Whatever keeps a frame from being sent: no SYNC, what was armed is neutralised, and SYNC waits for it.
TEST(CommonStart, AStopBeforeTheSyncKeepsItFromBeingSent) {
  for (const auto when : {50us, 150us, 199us}) {
    SCOPED_TRACE(when.count());
    Start start(10ms);
    start.launch();
    start.world.run_for(when);
    start.gates.back()->raise();
    const auto stopped = start.finish();
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().reason, Reason::superseded);
    EXPECT_NE(stopped.error().outcome, Outcome::unknown);
    start.world.run_for(1s);
    EXPECT_EQ(start.syncs(), 0);
    EXPECT_EQ(std::ranges::count(start.port->log, "305#0F01"), 1);
    EXPECT_EQ(std::ranges::count(start.port->log, "306#0F01"),
              std::ranges::count(start.port->log, "306#1F00"));
    start.bus->set_readiness(5, CanopenBus::Readiness::absent);
    start.bus->set_readiness(6, settled);
    start.world.run_for(1s);
    EXPECT_EQ(start.syncs(), 0) << "it may come back, armed";
    start.bus->set_readiness(5, settled);
    start.world.run_for(1s);
    EXPECT_GT(start.syncs(), 90);
  }
}

TEST(CommonStart, ALostFrameAbortsAll) {
  for (const auto status :
       {can::SendStatus::unknown, can::SendStatus::queue_full, can::SendStatus::expired}) {
    SCOPED_TRACE(to_string(status));
    Start start(10ms);
    start.port->on_sent = [&](const can::Frame& frame) {
      start.port->next_status = frame.id == 0x305 ? status : can::SendStatus::sent;
    };
    const auto lost = start.run();
    ASSERT_FALSE(lost);
    EXPECT_NE(lost.error().outcome, Outcome::unknown) << "no SYNC";
    start.world.run_for(1s);
    EXPECT_EQ(start.syncs(), 0);
  }
}

TEST(CommonStart, AnUnconfirmedSyncMayHaveStartedAll) {
  Start start(10ms);
  start.port->on_sent = [&](const can::Frame& frame) {
    start.port->next_status = frame.id == 0x306 ? can::SendStatus::unknown : can::SendStatus::sent;
  };
  const auto lost = start.run();
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().outcome, Outcome::unknown);
  start.port->next_status = can::SendStatus::sent;
  start.world.run_for(1s);
  EXPECT_EQ(start.syncs(), 0);
}

TEST(CommonStart, ADeafNodeKeepsSyncFromGoingOn) {
  Start start(10ms);
  start.deaf = {1};
  const auto lost = start.run();
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().outcome, Outcome::unknown) << "the other one has started";
  EXPECT_THAT(start.port->log, ElementsAre("305#1F00", "306#1F00", "080#", "306#0F01"));
  start.world.run_for(1s);
  EXPECT_EQ(start.syncs(), 1);
  start.port->receive(0x706, Bytes{0});  // it boots: its RAM is empty
  start.bus->set_readiness(6, settled);
  start.world.run_for(1s);
  EXPECT_GT(start.syncs(), 90);
}

TEST(CommonStart, AnotherSyncMeanwhileMayHaveStartedSome) {
  for (const auto when : {50us, 150us, 199us}) {
    SCOPED_TRACE(when.count());
    Start start(10ms);
    start.launch();
    start.world.run_for(when);
    start.port->receive(0x080, Bytes{});
    const auto disturbed = start.finish();
    ASSERT_FALSE(disturbed);
    EXPECT_EQ(disturbed.error().outcome, Outcome::unknown);
    const auto before = start.syncs();
    start.world.run_for(1s);
    EXPECT_EQ(start.syncs(), before);
  }
}

TEST(CommonStart, TheLinkGoesDownMeanwhile) {
  Start start(10ms);
  start.launch();
  start.world.run_for(50us);
  start.port->set_link(can::InterfaceState::bus_off);
  EXPECT_FALSE(start.finish());
  start.port->set_link(can::InterfaceState::up);
  start.world.run_for(1s);
  EXPECT_EQ(start.syncs(), 0) << "nobody was settled";
}

TEST(CommonStart, OneAfterTheOther) {
  Start start(10ms);
  std::optional<Result<TimePoint>> second;
  start.launch();
  const auto store = [](Start& self, std::optional<Result<TimePoint>>& to) -> Task<> {
    to = co_await self.bus->start_together(self.members());
  };
  spawn(start.world.executor(), store(start, second), "test");
  start.world.run_for(1ms);
  EXPECT_THAT(start.port->log, ElementsAre("305#1F00", "306#1F00", "080#", "305#1F00", "306#1F00", "080#"));
  EXPECT_TRUE(start.finish());
  EXPECT_TRUE(second && *second);
}

}  // namespace
}  // namespace axisd::canopen
