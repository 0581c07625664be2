// M14: everybody's stop counts. Holds are counted per holder, and outlive the daemon.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/rules/leased_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Whose = HoldRelease::Whose;

const Action move = MoveAbsoluteRequest{.position = 20};
constexpr auto held = StopRequest{.hold = true};

CommandOptions by(const std::string& client, const std::string& request = {}) {
  return {.client = client, .request_id = request};
}

class HeldRig : public LeasedRig {
 public:
  HeldRig()
      : LeasedRig(LeaseLoss::halt, {.switches = {{"enabled_at_power_up", false}}, .persistence = true}) {}

  /// Until it is answered.
  Result<StopReleased> release(const HoldRelease& which) {
    std::optional<Result<StopReleased>> answer;
    machine->release_stop("feeder", which, [&](auto result) { answer = std::move(result); });
    EXPECT_TRUE(run_until([&] { return answer.has_value(); }, 2s));
    return answer.value_or(fail(Reason::internal, "no answer"));
  }
  void hold(const std::string& client, const std::string& request = {}) {
    const auto stop = submit(held, by(client, request));
    EXPECT_TRUE(run_until([&] { return stop->has_ended(); }, 5s));
    EXPECT_EQ(stop->value().state, CommandState::done);
  }
  [[nodiscard]] bool can_move() {
    const auto command = try_submit(move, by("a"));
    if (command) EXPECT_TRUE(run_until([&] { return (*command)->has_ended(); }, 10s));
    return command.has_value();
  }
  [[nodiscard]] std::vector<StopHoldChange> changes() const {
    std::vector<StopHoldChange> all;
    for (const auto& event : machine->events().events_after(0, 1000).events)
      if (const auto* change = std::get_if<StopHoldChange>(&event.content)) all.push_back(*change);
    return all;
  }
};

TEST(M14Holds, MotionIsPossibleWhenEachHasReleased) {
  HeldRig rig;
  const auto running = rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(300ms);
  rig.hold("hmi", "r1");
  EXPECT_EQ(running->value().state, CommandState::aborted);
  rig.hold("panel", "r1");
  rig.hold("panel");
  const auto before = rig.load_mm();
  EXPECT_FALSE(rig.can_move());
  EXPECT_THAT(rig.release({.client = "hmi", .request_id = "r1"})->holds, SizeIs(2));
  EXPECT_FALSE(rig.can_move());
  EXPECT_EQ(rig.state()->state, AxisState::stopping);
  EXPECT_THAT(rig.release({.client = "panel"})->holds, SizeIs(1));
  EXPECT_FALSE(rig.can_move()) << "what has a name is released by its name";
  const auto last = rig.release({.client = "panel", .request_id = "r1"});
  EXPECT_THAT(last->holds, IsEmpty());
  ASSERT_TRUE(last->stop);
  EXPECT_EQ(last->stop->kind, CommandKind::stop);
  EXPECT_EQ(rig.state()->state, AxisState::standstill);
  rig.run(5s);
  EXPECT_EQ(rig.load_mm(), before) << "M1: nothing by itself";
  EXPECT_TRUE(rig.can_move());
}

TEST(M14Holds, NobodyReleasesAnothersWithoutSayingSo) {
  HeldRig rig;
  rig.hold("hmi", "r1");
  rig.hold("hmi");
  for (const auto& which :
       {HoldRelease{.client = "panel"}, HoldRelease{.client = "panel", .request_id = "r1"},
        HoldRelease{.client = "panel", .whose = Whose::mine},
        HoldRelease{.client = "hmi", .request_id = "r2"}}) {
    const auto refused = rig.release(which);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::invalid_argument);
    EXPECT_THAT(refused.error().message, HasSubstr("hmi (request r1) since "));
  }
  EXPECT_THAT(rig.state()->holds, SizeIs(2));
}

TEST(M14Holds, EverybodysIsForWhoeverMayCommandTheAxisAndIsAnEvent) {
  HeldRig rig;
  rig.hold("hmi", "r1");
  rig.hold("panel");
  const auto token = rig.lease("a", false, 60s);
  const auto other = rig.release({.client = "b", .whose = Whose::everybody});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().reason, Reason::lease_required);
  EXPECT_FALSE(rig.release({.client = "a", .whose = Whose::everybody})) << "the token is the right";
  EXPECT_THAT(rig.state()->holds, SizeIs(2));
  EXPECT_THAT(rig.release({.client = "hmi", .request_id = "r1"})->holds, SizeIs(1)) << "one's own: always";
  EXPECT_TRUE(rig.release({.client = "a", .whose = Whose::everybody, .lease_token = token}));
  EXPECT_THAT(rig.state()->holds, IsEmpty());
  const auto seen = rig.changes();
  ASSERT_THAT(seen, SizeIs(4));
  EXPECT_EQ(seen.at(0).what, StopHoldChange::What::held);
  EXPECT_EQ(seen.at(0).hold, (HoldKey{.holder = "hmi", .request_id = "r1"}));
  EXPECT_EQ(seen.at(3).what, StopHoldChange::What::released);
  EXPECT_EQ(seen.at(3).hold.holder, "panel");
  EXPECT_EQ(seen.at(3).by, "a");
}

TEST(M14Holds, WithoutALeaseAnybodyMayAsOfStopAll) {
  HeldRig rig;
  rig.hold("hmi", "r1");
  EXPECT_TRUE(rig.release({.client = "panel", .whose = Whose::everybody}));
  EXPECT_TRUE(rig.can_move());
}

TEST(M14Holds, RefusalsAndExplainSayWhoHolds) {
  HeldRig rig;
  rig.hold("hmi", "r1");
  rig.hold("panel");
  const auto names = AllOf(HasSubstr("hmi (request r1) since "), HasSubstr("panel since "));
  for (const auto& action : {move, Action(EnableRequest{}), Action(HomeRequest{}),
                             Action(JogRequest{.velocity = 5}), Action(MoveRelativeRequest{.distance = 5})}) {
    const auto refused = rig.try_submit(action, by("a"));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::stopping);
    EXPECT_THAT(refused.error().message, names);
    EXPECT_THAT(refused.error().remedy, HasSubstr("axisctl release-stop feeder"));
  }
  const auto obstacles = rig.axis().explain({}, by("panel"));
  ASSERT_FALSE(obstacles.empty());
  EXPECT_TRUE(std::ranges::any_of(obstacles, [&](const Obstacle& each) {
    return each.blocking && testing::Matches(names)(each.error.message);
  }));
  const auto run =
      rig.machine->groups().move({.targets = {{.axis = "feeder", .position = 10}}}, by("a", "g"));
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().reason, Reason::stopping);
}

TEST(M14Holds, OutlivesARestartAndAKill) {
  for (const bool killed : {false, true}) {
    SCOPED_TRACE(killed);
    HeldRig rig;
    rig.submit(MoveAbsoluteRequest{.position = 300});
    rig.run(300ms);
    rig.hold("hmi", "r1");
    rig.hold("panel");
    EXPECT_TRUE(std::ranges::all_of(rig.state()->holds, &StopHold::durable));
    ASSERT_TRUE(rig.state()->enabled);
    const auto before = rig.load_mm();
    killed ? rig.kill_daemon() : rig.stop_daemon();
    rig.idle(1s);
    rig.start_daemon();
    rig.run(2s);
    EXPECT_EQ(rig.state()->state, AxisState::stopping);
    ASSERT_THAT(rig.state()->holds, SizeIs(2));
    EXPECT_TRUE(rig.state()->enabled) << "M1: the power stage is left as it is";
    EXPECT_EQ(rig.triggers(), 0);
    EXPECT_EQ(rig.writes_of(0x000F), 0);
    EXPECT_EQ(rig.load_mm(), before);
    EXPECT_EQ(rig.try_submit(EnableRequest{}, by("a")).error().reason, Reason::stopping);
    EXPECT_EQ(rig.try_submit(JogRequest{.velocity = 5}, by("a")).error().reason, Reason::stopping);
    const auto first = rig.release({.client = "hmi", .request_id = "r1"});
    ASSERT_TRUE(first);
    EXPECT_FALSE(first->stop) << "the stop was of another run";
    EXPECT_EQ(rig.state()->state, AxisState::stopping);
    EXPECT_TRUE(rig.release({.client = "panel"}));
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
    rig.stop_daemon();
    rig.start_daemon();
    EXPECT_THAT(rig.state()->holds, IsEmpty()) << "a release outlives a restart, too";
    EXPECT_TRUE(rig.try_submit(JogRequest{.velocity = 5}, by("a")));
  }
}

TEST(M14Holds, AStopWaitsForNoDiskAndItsAnswerDoes) {
  HeldRig rig;
  const auto running = rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(300ms);
  rig.store.slow = true;
  int settled = 0;
  const auto stop = rig.machine->submit_held("feeder", held, by("hmi", "r1"), [&] { ++settled; });
  ASSERT_TRUE(stop);
  ASSERT_TRUE(rig.run_until([&] { return (*stop)->has_ended(); }, 900ms));
  EXPECT_EQ((*stop)->value().state, CommandState::done);
  EXPECT_EQ(settled, 0);
  ASSERT_THAT(rig.state()->holds, SizeIs(1));
  EXPECT_FALSE(rig.state()->holds.front().durable);
  EXPECT_FALSE(rig.can_move());
  rig.store.release();
  rig.run(1ms);
  EXPECT_EQ(settled, 1);
  EXPECT_TRUE(rig.state()->holds.front().durable);
  rig.run(5s);
  EXPECT_EQ(settled, 1);
}

TEST(M14Holds, TheAnswerWaitsForAStuckDiskForASecond) {
  HeldRig rig;
  rig.store.slow = true;
  int settled = 0;
  ASSERT_TRUE(rig.machine->submit_held("feeder", held, by("hmi"), [&] { ++settled; }));
  rig.run(999ms);
  EXPECT_EQ(settled, 0);
  rig.run(2ms);
  EXPECT_EQ(settled, 1);
  EXPECT_FALSE(rig.state()->holds.front().durable);
  EXPECT_FALSE(rig.can_move());
  rig.store.release();
  rig.run(1ms);
  EXPECT_EQ(settled, 1) << "once";
  EXPECT_TRUE(rig.state()->holds.front().durable);
}

TEST(M14Holds, AFailingDiskCostsNeitherTheStopNorTheHold) {
  HeldRig rig;
  rig.submit(MoveAbsoluteRequest{.position = 300});
  rig.run(300ms);
  rig.store.failing = true;
  int settled = 0;
  const auto stop = rig.machine->submit_held("feeder", held, by("hmi"), [&] { ++settled; });
  ASSERT_TRUE(rig.run_until([&] { return (*stop)->has_ended() && settled == 1; }, 5s));
  EXPECT_EQ((*stop)->value().state, CommandState::done);
  EXPECT_FALSE(rig.state()->holds.front().durable);
  EXPECT_FALSE(rig.can_move());
  for (int i = 0; i < 5; ++i) rig.hold("hmi");
  EXPECT_EQ(std::ranges::count(rig.changes(), StopHoldChange::What::not_durable, &StopHoldChange::what), 1)
      << "told once";
  const auto refused = rig.release({.client = "hmi"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::storage);
  EXPECT_FALSE(rig.can_move()) << "it would come back with a restart";
  rig.store.failing = false;
  EXPECT_TRUE(rig.release({.client = "hmi"}));
  EXPECT_TRUE(rig.can_move());
}

TEST(M14Holds, AStopWhileItIsBeingReleasedHolds) {
  HeldRig rig;
  rig.hold("hmi");
  rig.store.slow = true;
  std::optional<Result<StopReleased>> answer;
  rig.machine->release_stop("feeder", {.client = "hmi"}, [&](auto result) { answer = std::move(result); });
  rig.run(10ms);
  EXPECT_FALSE(rig.can_move()) << "a release counts once it is durable";
  rig.hold("hmi");
  rig.store.release();
  ASSERT_TRUE(rig.run_until([&] { return answer.has_value(); }, 1s));
  ASSERT_FALSE(*answer);
  EXPECT_EQ(answer->error().reason, Reason::stopping);
  EXPECT_FALSE(rig.can_move());
  EXPECT_THAT(rig.store.saved.axes.at("feeder").holds, SizeIs(1)) << "after a restart, too";
  EXPECT_TRUE(rig.release({.client = "hmi"}));
  EXPECT_TRUE(rig.can_move());
}

/// A stop overtakes what waits for the core: a release that came before it does not end it.
TEST(M14Holds, AReleaseThatArrivedBeforeTheStopDoesNotEndIt) {
  HeldRig rig;
  rig.hold("hmi");
  const auto arrived = rig.world.now();
  rig.run(1ms);
  auto options = by("hmi");
  options.arrived = rig.world.now();
  rig.submit(held, options);
  const auto refused = rig.release({.client = "hmi", .arrived = arrived});
  ASSERT_FALSE(refused);
  EXPECT_FALSE(rig.can_move());
}

TEST(M14Holds, AFullTableRefusesNoStop) {
  HeldRig rig;
  for (std::size_t i = 0; i < StopHolds::share + 10; ++i) rig.hold("flood", "r" + std::to_string(i));
  EXPECT_THAT(rig.state()->holds, SizeIs(StopHolds::share + 1));
  rig.hold("hmi", "mine");
  EXPECT_TRUE(rig.release({.client = "flood", .whose = Whose::mine}));
  ASSERT_THAT(rig.state()->holds, SizeIs(1));
  EXPECT_EQ(rig.state()->holds.front().key.holder, "hmi");
  EXPECT_FALSE(rig.can_move());
  EXPECT_TRUE(rig.release({.client = "hmi", .request_id = "mine"}));
  EXPECT_TRUE(rig.can_move());
}

TEST(M14Holds, NeitherResetNorDisableNorAnotherStopEndsAHold) {
  HeldRig rig;
  rig.hold("hmi");
  EXPECT_EQ(rig.complete(DisableRequest{}).state, CommandState::done);
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);
  EXPECT_EQ(rig.complete(StopRequest{.kind = StopKind::halt}).state, CommandState::done);
  (void)rig.try_submit(ResetRequest{}, by("hmi"));
  rig.run(2s);
  EXPECT_EQ(rig.state()->state, AxisState::stopping);
  EXPECT_EQ(rig.try_submit(EnableRequest{}, by("hmi")).error().reason, Reason::stopping);
  EXPECT_TRUE(rig.release({.client = "hmi"}));
  EXPECT_EQ(rig.state()->state, AxisState::disabled);
}

}  // namespace
}  // namespace axisd::test
