// Groups that start at a moment, together with axes of other machines (M22, M6, M31): prepared, told, in
// time.
#include <gmock/gmock.h>

#include "daemon/core/group_access_service.hpp"
#include "tests/rules/m22_moment_rig.hpp"

namespace axisd::test {
namespace {

using simulation::FaultKind;

TEST(M22Moment, TheFirstStartFrameGoesOutAtTheMoment) {
  struct Case {
    std::map<std::string, double> places;
    int baud;
  };
  for (const auto& [places, baud] :
       {Case{{{"x", 50}, {"y", 50}}, 115200}, Case{{{"x", 50}, {"y", 50}}, 9600}, Case{{{"y", 50}}, 9600},
        Case{{{"x", 50}, {"y", 50}, {"z", 50}, {"w", 50}}, 115200}, Case{{{"z", 50}, {"w", 50}}, 115200}}) {
    SCOPED_TRACE(std::to_string(places.size()) + " at " + std::to_string(baud));
    MomentRig rig({.baud = baud, .can_axes = 2});
    const auto run = rig.prepare(places);
    EXPECT_TRUE(rig.rests(600ms));
    rig.line->forget_wire();
    const auto at = rig.tell(run, 700ms);
    rig.keep(run, at - rig.world.now() - 1us);
    EXPECT_EQ(rig.all_starts(), 0);
    EXPECT_TRUE(rig.start_frames().empty());
    auto truth = rig.watch(200ms);
    for (const auto& [axis, place] : places) EXPECT_EQ(rig.starts(axis), 1) << axis;
    const auto move = run->value();
    ASSERT_TRUE(move.preparation->first_start && move.start_skew) << cause_of(run);
    EXPECT_EQ(move.preparation->starts_at, at);
    const bool by_sync = places.contains("z");
    const auto first = by_sync ? *move.preparation->first_start : rig.start_frames().front();
    EXPECT_GE(first, at);
    EXPECT_LE(first, at + 1ms);
    auto earliest = TimePoint::max();
    for (const auto& [axis, journey] : truth) earliest = std::min(earliest, *journey.begun);
    EXPECT_GE(earliest, at);
    EXPECT_LE(earliest, at + 30ms) << "the first pulse of a ramp";
    rig.keep(run, 3s);
    EXPECT_EQ(run->state(), CommandState::done) << cause_of(run);
    for (const auto& [axis, place] : places) EXPECT_NEAR(rig.load_mm(axis), place, 0.011);
  }
}

/// What a start rests on is read again right before the moment (M6), and the answers say beforehand how long
/// that takes.
TEST(M22Moment, EveryMemberIsLookedAtAgainRightBefore) {
  MomentRig rig;
  const auto run = rig.prepare({{"x", 50}, {"y", 50}});
  const auto found = *run->value().preparation;
  EXPECT_GT(found.notice, 30ms);
  EXPECT_LT(found.notice, 300ms);
  EXPECT_GT(found.predicted_skew, 1ms);
  EXPECT_LT(found.predicted_skew, 20ms);
  EXPECT_EQ(*found.expires - rig.world.now(), GroupRun::longest_preparation);
  rig.run(300ms);
  rig.line->forget_wire();
  const auto at = rig.tell(run);
  rig.keep(run, 2s);
  EXPECT_EQ(run->state(), CommandState::done) << cause_of(run);
  for (const std::uint8_t node : {1, 2}) {
    auto last_block = TimePoint{}, last_canary = TimePoint{}, start = TimePoint{};
    for (const auto& entry : rig.line->wire()) {
      if (entry.node() != node || (start != TimePoint{})) continue;
      if (entry.is_write() && entry.address() == 0x0020) last_block = entry.begin;
      if (!entry.is_write() && entry.address() == 0x0020) last_canary = entry.begin;
      if (entry.is_write() && entry.address() == start_register) start = entry.begin;
    }
    EXPECT_GT(last_block, at - found.notice);
    EXPECT_GT(last_canary, last_block);
    EXPECT_LE(start - last_canary, 100ms);
  }
}

/// Others at rest are not in its way. Those that move are read on, as their bounds are published: that is one
/// exchange.
TEST(M22Moment, TheLineIsFreeAtTheMoment) {
  for (const bool others_move : {false, true})
    for (const int baud : {115200, 19200})
      for (auto shift = 0ms; shift < 12ms; shift += 3ms) {
        SCOPED_TRACE(std::to_string(baud) + (others_move ? ", others move" : ""));
        MomentRig rig({.baud = baud, .more_serial_axes = 4});
        const auto run = rig.prepare({{"x", 50}, {"y", 50}});
        rig.run(shift);
        if (others_move)
          for (const auto* axis : {"a", "b", "c", "d"})
            ASSERT_TRUE(rig.machine->submit(axis, MoveAbsoluteRequest{.position = 300}, {}));
        rig.run(700ms);
        if (others_move) EXPECT_EQ(rig.starts("d"), 1) << "what is only prepared keeps nobody from starting";
        rig.line->forget_wire();
        const auto at = rig.tell(run, 800ms);
        rig.keep(run, 2s);
        ASSERT_FALSE(rig.start_frames().empty()) << cause_of(run);
        const auto late = rig.start_frames().front() - at;
        EXPECT_GE(late, 0ms);
        EXPECT_LE(late, !others_move ? 1ms : baud == 19200 ? 35ms : 10ms);
        EXPECT_EQ(run->state(), CommandState::done) << cause_of(run);
      }
}

/// Where the verification takes long: others at rest are read until it begins.
TEST(M22Moment, ASlowLineIsHeldBrieflyToo) {
  MomentRig rig({.baud = 9600, .more_serial_axes = 4});
  const auto run = rig.prepare({{"x", 50}});
  rig.line->forget_wire();
  const auto at = rig.tell(run, 900ms);
  rig.keep(run, 1100ms);
  ASSERT_EQ(rig.start_frames().size(), 1U) << cause_of(run);
  const auto start = rig.start_frames().front();
  EXPECT_LE(start - at, 1ms);
  auto last_of_others = TimePoint{}, first_after = TimePoint::max();
  for (const auto& entry : rig.line->wire()) {
    if (entry.node() == 1) continue;
    if (entry.begin < start) last_of_others = entry.begin;
    if (entry.begin > start) first_after = std::min(first_after, entry.begin);
  }
  EXPECT_GE(last_of_others - at, -190ms);
  EXPECT_LE(first_after - at, 300ms) << "the line is let go";
}

/// M31: by how much the first start may be late, whatever holds it up.
TEST(M22Moment, WhatCannotBeInTimeDoesNotStart) {
  {
    MomentRig rig;  // the process is paused over the moment
    const auto run = rig.prepare({{"x", 50}, {"z", 50}});
    const auto at = rig.tell(run);
    rig.keep(run, at - 1ms - rig.world.now());
    rig.world.clock().advance_to(at + GroupRun::latest_start + 1ms);
    rig.keep(run, 500ms);
    ASSERT_TRUE(run->value().cause) << "it has started";
    EXPECT_EQ(run->value().cause->reason, Reason::expired) << cause_of(run);
    rig.expect_nothing_started(run);
  }
  for (const auto ahead : {160ms, 40ms}) {
    SCOPED_TRACE(ahead.count());
    MomentRig rig;  // a drive does not answer the last look
    const auto run = rig.prepare({{"x", 50}, {"y", 50}});
    const auto at = rig.tell(run);
    rig.keep(run, at - ahead - rig.world.now());
    rig.faults().add({.kind = FaultKind::drop_reply, .node = 1, .count = 40});
    rig.keep(run, 1s);
    for (const auto begin : rig.start_frames()) EXPECT_LE(begin, at + GroupRun::latest_start);
    EXPECT_TRUE(ended(run->state())) << cause_of(run);
    rig.run(1s);
    EXPECT_TRUE(rig.rests(2s));
  }
}

TEST(M22Moment, AMomentThatIsTooNearTooFarOrPastIsRefusedAndChangesNothing) {
  MomentRig rig;
  const auto run = rig.begin({{"x", 20}, {"y", 20}});
  EXPECT_EQ(run->start_at(rig.world.now() + 1s).error().reason, Reason::busy);
  ASSERT_TRUE(rig.run_until([&] { return run->prepared(); }, 5s));
  const auto found = *run->value().preparation;
  for (const auto at : {rig.world.now() - 1s, rig.world.now(), rig.world.now() + found.notice - 1ns})
    EXPECT_EQ(run->start_at(at).error().reason, Reason::expired);
  EXPECT_EQ(run->start_at(*found.expires + 1ns).error().reason, Reason::out_of_range);
  EXPECT_FALSE(run->value().preparation->starts_at);
  EXPECT_TRUE(run->start_at(*found.expires)) << "the last one";
  rig.keep(run, 4s);
  EXPECT_EQ(run->state(), CommandState::done) << cause_of(run);
}

TEST(M22Moment, TheSameMomentAgainAttachesAndAnotherIsRefused) {
  MomentRig rig;
  const auto run = rig.prepare({{"x", 20}, {"y", 20}});
  const auto at = rig.tell(run, 400ms);
  EXPECT_TRUE(run->start_at(at));
  EXPECT_EQ(run->start_at(at + 1ms).error().reason, Reason::request_id_conflict);
  rig.keep(run, 2s);
  EXPECT_EQ(run->state(), CommandState::done) << cause_of(run);
  EXPECT_TRUE(run->start_at(at)) << "its answer was lost";
  rig.keep(run, 2s);
  for (const auto* axis : {"x", "y"}) EXPECT_EQ(rig.starts(axis), 1);
}

TEST(M22Moment, ARepeatedRequestGetsTheSameMoveAndNoOtherKind) {
  MomentRig rig;
  const CommandOptions options{.client = "a", .request_id = "r1"};
  const auto run = rig.prepare({{"x", 20}, {"y", 20}}, options);
  EXPECT_EQ(rig.prepare({{"x", 20}, {"y", 20}}, options), run);
  const auto at_once = rig.try_move(GroupRig::to({{"x", 20}, {"y", 20}}), options);
  ASSERT_FALSE(at_once);
  EXPECT_EQ(at_once.error().reason, Reason::request_id_conflict);
  rig.tell(run);
  rig.keep(run, 2s);
  EXPECT_EQ(rig.begin({{"x", 20}, {"y", 20}}, options), run);
  for (const auto* axis : {"x", "y"}) EXPECT_EQ(rig.starts(axis), 1);
}

/// As MoveGroup: what forbids one is known at once, and what shows in the last look, too.
TEST(M22Moment, WhatForbidsOneForbidsAll) {
  MomentRig rig;
  auto request = GroupRig::to({{"x", 20}, {"y", 500}});
  request.start = GroupStart::when_told;
  const auto refused = rig.try_move(request);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::soft_limit);
  const auto run = rig.prepare({{"x", 50}, {"y", 50}});
  const auto busy = rig.try_move(GroupRig::to({{"x", 20}, {"z", 20}}));
  ASSERT_FALSE(busy);
  EXPECT_EQ(busy.error().reason, Reason::moving);
}

/// At 9600 bit/s a last look at many takes longer than a preparation lasts.
TEST(M22Moment, TooManyForASlowLineAreToldSo) {
  MomentRig rig({.baud = 9600, .more_serial_axes = 8});
  const auto run = rig.begin(
      {{"x", 9}, {"y", 9}, {"a", 9}, {"b", 9}, {"c", 9}, {"d", 9}, {"e", 9}, {"f", 9}, {"g", 9}, {"h", 9}});
  ASSERT_TRUE(rig.ends(run, 10s));
  EXPECT_EQ(run->value().cause->reason, Reason::not_supported) << cause_of(run);
  rig.expect_nothing_started(run);
}

TEST(M22Moment, ItIsStartedAndRenewedByWhoPreparedIt) {
  MomentRig rig;
  core::GroupAccessService access(rig.world.loop(), *rig.machine);
  auto request = GroupRig::to({{"x", 20}, {"y", 20}});
  request.start = GroupStart::when_told;
  std::optional<Result<GroupMove>> answer;
  const auto take = [&](Result<GroupMove> result) { answer = std::move(result); };
  const auto answered = [&] {
    EXPECT_TRUE(rig.run_until([&] { return answer.has_value(); }, 5s));
    return *std::exchange(answer, {});
  };
  access.move(request, {.client = "a"}, WaitUntil::accepted, take);
  const auto prepared = answered();
  ASSERT_TRUE(prepared);
  EXPECT_EQ(prepared->state, CommandState::accepted);
  ASSERT_TRUE(prepared->preparation && prepared->preparation->expires) << "it answers once it is prepared";
  const auto at = rig.world.now() + 400ms;
  access.start({.id = prepared->id, .client = "b", .at = at}, WaitUntil::accepted, take);
  EXPECT_EQ(answered().error().reason, Reason::access_denied);
  access.renew(prepared->id, "b", GroupRenewal::all_told, take);
  EXPECT_EQ(answered().error().reason, Reason::access_denied);
  access.renew("t-g99", "a", GroupRenewal::all_told, take);
  EXPECT_EQ(answered().error().reason, Reason::unknown_command);
  access.start({.id = prepared->id, .client = "a", .at = at}, WaitUntil::done, take);
  for (int i = 0; i < 50 && !answer; ++i) {
    access.renew(prepared->id, "a", GroupRenewal::all_told, [](const auto&) {});
    rig.run(100ms);
  }
  const auto done = answered();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(done->state, CommandState::done);
  access.renew(prepared->id, "a", GroupRenewal::waits, take);
  EXPECT_EQ(answered()->state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
