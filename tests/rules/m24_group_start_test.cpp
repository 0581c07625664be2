// Group start by SYNC (M22, M24): drives start in one SYNC, or none of them does, whatever happens meanwhile.
#include <gtest/gtest.h>

#include <random>

#include "tests/rules/m24_group_bench.hpp"

namespace axisd::test {
namespace {

using simulation::FaultKind;

constexpr std::uint32_t sync_id = 0x80;

void expect_started_once(GroupBench& bench, std::int64_t target) {
  for (auto& member : bench.members) {
    EXPECT_EQ(member.node->starts(), 1) << "node " << int{member.node->address()};
    EXPECT_EQ(bench.shaft(member), target);
  }
}

/// Together to 0, which takes no longer than `duration`.
void goes_back(GroupBench& bench, Duration duration) {
  ASSERT_TRUE(bench.prepare(0));
  ASSERT_TRUE(bench.start());
  bench.run(duration);
  for (auto& member : bench.members) EXPECT_EQ(bench.shaft(member), 0);
}

TEST(M24GroupStart, DrivesStartInOneSync) {
  for (const int drives : {2, 16}) {
    SCOPED_TRACE(drives);
    GroupBench bench({.drives = drives});
    bench.ready();
    ASSERT_TRUE(bench.prepare(2000));
    bench.run(50ms);
    bench.frames.clear();
    const auto at = bench.start();
    ASSERT_TRUE(at) << to_string(at.error());
    const auto sync =
        std::ranges::find_if(bench.frames, [&](const auto& frame) { return frame.first == *at; });
    ASSERT_NE(sync, bench.frames.end());
    EXPECT_EQ(sync->second.id, sync_id);
    EXPECT_TRUE(bench.any_moves());
    bench.run(1500ms);
    expect_started_once(bench, 2000);
    // The cadence of before: no cycle in between, none twice. 16 drives fill the network too much to see it.
    std::vector<TimePoint> syncs;
    for (const auto& [time, frame] : bench.frames)
      if (frame.id == sync_id && time != *at) syncs.push_back(time);
    ASSERT_GT(syncs.size(), 100U);
    for (std::size_t i = 2; drives == 2 && i < syncs.size(); ++i)
      EXPECT_LT(std::chrono::abs((syncs[i] - syncs[1] + 5ms) % 10ms - 5ms), 500us);
    // And again, back: nothing is left of the first time.
    goes_back(bench, 1500ms);
  }
}

TEST(M24GroupStart, PreparingMovesNothingAndLeavesNothing) {
  GroupBench bench;
  bench.ready();
  bench.frames.clear();
  ASSERT_TRUE(bench.prepare(2000));
  EXPECT_EQ(bench.count_of(0x300U + 16), 0);
  bench.put(sync_id, {});
  bench.run(1s);
  for (auto& member : bench.members) member.move.reset();
  bench.run(1s);
  for (auto& member : bench.members) EXPECT_EQ(member.node->starts(), 0);
}

/// The proof of the block is one answer of each, and not all five.
TEST(M24GroupStart, SlowAnswersPermitIt) {
  GroupBench bench;
  bench.ready();
  bench.fault({.kind = simulation::FaultKind::delay_reply, .count = -1, .delay = 25ms});
  ASSERT_TRUE(bench.prepare(2000));
  const auto started = bench.start();
  ASSERT_TRUE(started) << to_string(started.error());
  bench.run(3s);
  expect_started_once(bench, 2000);
}

/// M25: what waits for the others of its group may be written by another master meanwhile.
TEST(M24GroupStart, WhatAnotherMasterHasWrittenIsNotStarted) {
  GroupBench bench;
  bench.ready();
  ASSERT_TRUE(bench.prepare(2000));
  bench.put(0x600U + 16, {0x23, 0x81, 0x60, 0, 0xE8, 0x03, 0, 0});  // 6081h
  bench.run(2ms);
  ASSERT_EQ(bench.members[0].node->peek(0x608100), 1000U);
  const auto started = bench.start();
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().outcome, Outcome::unknown) << to_string(started.error());
  bench.run(1s);
  for (auto& member : bench.members) EXPECT_EQ(member.node->starts(), 0);
}

/// Each way in which a drive may differ from CiA 301: known before anything is started by it.
TEST(M24GroupStart, WhereAnRpdoIsNotAsItMustBeThereIsNone) {
  for (const auto* name :
       {"rpdo_sync_refused", "rpdo_type_ignored", "rpdo_first_counts", "rpdo_repeated", "rpdo_kept"}) {
    SCOPED_TRACE(name);
    GroupBench bench({.switches = {{name, true}}});
    ASSERT_TRUE(bench.online());
    bench.run(5s);
    for (auto& member : bench.members) {
      const auto why = member.drive->no_common_start();
      EXPECT_FALSE(why.empty());
      EXPECT_EQ(why.find("not proven yet"), std::string::npos) << why;
      EXPECT_TRUE(bench.finish(member.drive->enable(member.guard())));
      const auto refused = bench.finish(member.drive->prepare_move({.target_pulses = 100}, member.guard()));
      ASSERT_FALSE(refused);
      EXPECT_EQ(refused.error().reason, Reason::not_supported);
      EXPECT_GT(member.node->peek(0x140102), 240U) << "nothing is left that a SYNC could act on";
      // What it was shown with changes nothing later.
      bench.run(1s);
      EXPECT_EQ(member.node->peek(0x604000), 0x0FU);
      EXPECT_TRUE(bench.finish(member.drive->start_move(
          {.target_pulses = 500, .velocity_rpm = 300, .acceleration_time = 50ms, .deceleration_time = 50ms},
          member.guard())));
    }
    bench.run(3s);
    expect_started_once(bench, 500);
    EXPECT_TRUE(bench.bus.sync_running());
  }
}

TEST(M24GroupStart, OtherReadingsOfTheDriveChangeNothing) {
  for (const auto* name : {"pdo_parameters_read_only", "rpdo_applied_by_type", "halt_release_resumes"}) {
    SCOPED_TRACE(name);
    const auto specs = yss_c::switch_specs();
    const auto spec = std::ranges::find(specs, std::string_view(name), &simulation::SwitchSpec::name);
    ASSERT_NE(spec, specs.end());
    GroupBench bench({.switches = {{name, !spec->default_value}}});
    bench.ready();
    ASSERT_TRUE(bench.prepare(1000));
    ASSERT_TRUE(bench.start());
    bench.run(3s);
    expect_started_once(bench, 1000);
  }
}

TEST(M24GroupStart, WithoutSyncThereIsNone) {
  GroupBench bench({.sync_period = Duration{}});
  ASSERT_TRUE(bench.online());
  bench.run(3s);
  EXPECT_EQ(bench.count_of(sync_id), 0);
  EXPECT_NE(bench.members[0].drive->no_common_start().find("sync_period"), std::string::npos);
}

/// An object 60xxh.
void write(simulation::SimulatedCanNode& node, std::uint8_t object, std::uint8_t size, std::uint8_t value) {
  node.on_frame(can::make_frame(0x600U + node.address(),
                                std::vector<std::uint8_t>{static_cast<std::uint8_t>(0x23 | (4 - size) << 2),
                                                          object, 0x60, 0, value, 0, 0, 0}));
}

/// M1: a stop of a released drive that shows its RPDO just then. Nobody knows its bits.
TEST(M24GroupStart, AStopDuringTheProofEnergisesNothing) {
  for (const bool acts_at_once : {true, false})
    for (auto when = 0us; when < 3000us; when += 170us) {
      SCOPED_TRACE(testing::Message() << acts_at_once << " " << when.count());
      GroupBench bench({.drives = 1,
                        .switches = {{"rpdo_type_ignored", acts_at_once}},
                        .before_start = [](auto& node) { write(node, 0x40, 2, 0x06); }});
      auto& member = bench.members.front();
      ASSERT_TRUE(bench.run_until([&] { return bench.count_of(0x310) > 0; }, 20s));
      bench.run(when);
      bench.stop(member);
      bench.run(400us);
      bench.put(sync_id, {});  // of somebody else
      bool energised = false;
      bench.run_until([&] { return energised = energised || (member.node->peek(0x604100) & 0x04U) != 0; },
                      2s);
      EXPECT_FALSE(energised);
      EXPECT_EQ(member.node->peek(0x604000) & 0x0FU, 0x06U);
    }
}

/// M25: what is energised when it is found stays so, and shows nothing until it is released.
TEST(M24GroupStart, AnEnergisedDriveIsAdoptedAsItIs) {
  GroupBench bench({.before_start = [&](auto& node) {
    write(node, 0x60, 1, 1);
    for (const std::uint8_t word : {0x00, 0x06, 0x07, 0x0F}) write(node, 0x40, 2, word);
  }});
  ASSERT_TRUE(bench.online());
  bench.run(3s);
  for (auto& member : bench.members) {
    EXPECT_EQ(member.node->peek(0x604100) & 0x6F, 0x27U);
    EXPECT_NE(member.drive->no_common_start().find("released"), std::string::npos)
        << member.drive->no_common_start();
    EXPECT_EQ(bench.count_of(0x300U + member.node->address()), 0);
  }
  for (auto& member : bench.members) EXPECT_TRUE(bench.finish(member.drive->disable({})));
  EXPECT_TRUE(bench.proven());
}

TEST(M24GroupStart, AStopBetweenArmingAndSyncStopsAll) {
  // Frames take some 60 us at 1 Mbit/s: from before the first of them until after the SYNC.
  for (auto when = 0us; when < 1200us; when += 70us) {
    SCOPED_TRACE(when.count());
    GroupBench bench({.drives = 4});
    bench.ready();
    ASSERT_TRUE(bench.prepare(3000));
    auto& started = bench.launch();
    // The last look takes some milliseconds; the frames that arm are what counts.
    bench.run_until([&] { return bench.count_of(0x310) > 0; }, 1s);
    bench.run(when);
    bench.stop(bench.members[2]);
    ASSERT_TRUE(bench.run_until([&] { return started.has_value(); }, 5s));
    if (*started || (*started).error().outcome == Outcome::unknown) bench.stop_all();
    const bool none = !*started && (*started).error().outcome != Outcome::unknown;
    bench.run(500ms);
    std::vector<std::int64_t> at;
    for (auto& member : bench.members) at.push_back(bench.shaft(member));
    EXPECT_FALSE(bench.any_moves());
    bench.run(2s);
    EXPECT_TRUE(bench.bus.sync_running());
    for (std::size_t i = 0; i < at.size(); ++i) {
      EXPECT_EQ(bench.shaft(bench.members[i]), at[i]) << "moved after the stop";
      EXPECT_LE(bench.members[i].node->starts(), none ? 0 : 1);
    }
    // It goes on as if nothing had been.
    goes_back(bench, 3s);
  }
}

TEST(M24GroupStart, AReleaseAfterAnAbortedStartIsNotUndoneByASync) {
  GroupBench bench;
  bench.ready();
  ASSERT_TRUE(bench.prepare(2000));
  // The second one loses what arms it: the first is armed, and given up.
  bench.members[1].gate->raise();
  EXPECT_FALSE(bench.start());
  for (auto& member : bench.members) EXPECT_TRUE(bench.finish(member.drive->disable({})));
  bench.put(sync_id, {});
  bench.run(2s);
  for (auto& member : bench.members) {
    EXPECT_EQ(member.node->peek(0x604100) & 0x2000, 0U) << "energised by itself";
    EXPECT_EQ(member.node->starts(), 0);
  }
}

TEST(M24GroupStart, ANodeThatHearsNothingKeepsSyncFromGoingOnUntilItIsSettled) {
  GroupBench bench({.drives = 3});
  bench.ready();
  ASSERT_TRUE(bench.prepare(2000));
  auto& started = bench.launch();
  // It hears what arms it, and nothing after that for a while.
  bench.run_until([&] { return bench.count_of(0x311) > 0; }, 1s);
  bench.fault({.kind = FaultKind::silence, .node = 17, .delay = 8s});
  ASSERT_TRUE(bench.run_until([&] { return started.has_value(); }, 5s));
  ASSERT_FALSE(*started);
  EXPECT_EQ((*started).error().outcome, Outcome::unknown);
  bench.stop_all();
  bench.run(500ms);
  bench.frames.clear();
  bench.run(3s);
  EXPECT_EQ(bench.count_of(sync_id), 0) << "it would start when it hears again";
  EXPECT_FALSE(bench.bus.sync_trouble()) << "mostly it is over by itself";
  bench.run(3s);
  ASSERT_TRUE(bench.bus.sync_trouble()) << "nobody is told";
  EXPECT_EQ(bench.bus.sync_trouble()->where.node, 17);
  EXPECT_NE(bench.bus.sync_trouble()->remedy.find("supply"), std::string::npos);
  bench.run(5s);
  EXPECT_FALSE(bench.bus.sync_trouble());
  EXPECT_TRUE(bench.online());
  EXPECT_TRUE(bench.bus.sync_running());
  EXPECT_EQ(bench.members[1].node->starts(), 0);
  EXPECT_EQ(bench.shaft(bench.members[1]), 0);
}

/// Seeded faults at random times around the start: each member moves at most once, and only by a SYNC that
/// was sent while all were armed, or it is stopped; later nothing moves by itself.
TEST(M24GroupStart, NobodyMovesTwiceLateOrByItselfUnderFaults) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto pick = [&](int from, int to) { return std::uniform_int_distribution(from, to)(random); };
    GroupBench bench({.drives = 3});
    bench.ready();
    ASSERT_TRUE(bench.prepare(30'000));
    bench.run(std::chrono::microseconds(pick(0, 10'000)));
    auto& started = bench.launch();
    if (pick(0, 3) > 0) bench.run_until([&] { return bench.count_of(0x310) > 0 || started; }, 50ms);
    bench.run(std::chrono::microseconds(pick(0, 1500)));
    auto& victim = bench.members.at(static_cast<std::size_t>(pick(0, 2)));
    const auto node = victim.node->address();
    const auto kind = pick(0, 8);
    SCOPED_TRACE(kind);
    const bool foreign_sync = kind == 5;
    switch (kind) {
      case 0:
        bench.stop(victim);
        break;
      case 1:
        bench.fault(
            {.kind = FaultKind::reboot, .node = node, .delay = std::chrono::milliseconds(pick(0, 300))});
        break;
      case 2:
        bench.fault(
            {.kind = FaultKind::silence, .node = node, .delay = std::chrono::milliseconds(pick(1, 3000))});
        break;
      case 3:
        bench.fault({.kind = FaultKind::drop_reply, .node = node, .count = pick(1, 4)});
        break;
      case 4:
        bench.port().report(can::Controller::bus_off);
        bench.run(std::chrono::milliseconds(pick(1, 300)));
        bench.port().cycle();
        break;
      case 5:
        bench.put(sync_id, {});
        break;
      case 6:
        victim.gate->raise();
        bench.bus.purge_superseded(node, *victim.gate);
        break;
      case 7:
        bench.fault({.kind = FaultKind::drop_request,
                     .node = node,
                     .count = 1,
                     .cob = pick(0, 1) ? 0x080 : 0x300 + node});
        break;
      default:
        bench.fault({.kind = FaultKind::emcy, .node = node, .code = 0xFF04});
    }
    ASSERT_TRUE(bench.run_until([&] { return started.has_value(); }, 10s));
    const bool none = !*started && (*started).error().outcome != Outcome::unknown;
    if (!*started || kind == 0) bench.stop_all();
    bench.run(1s);
    if (!*started || kind == 0) {
      // Whoever could not hear its stop is stopped when it can.
      bench.online();
      bench.stop_all();
      bench.run(500ms);
      EXPECT_FALSE(bench.any_moves());
    }
    std::vector<std::int64_t> at;
    for (auto& member : bench.members) {
      EXPECT_LE(member.node->starts(), none && !foreign_sync ? 0 : 1);
      at.push_back(bench.shaft(member));
    }
    bench.run(6s);
    for (std::size_t i = 0; i < at.size(); ++i) {
      EXPECT_LE(bench.members[i].node->starts(), none && !foreign_sync ? 0 : 1);
      if (!*started) EXPECT_EQ(bench.shaft(bench.members[i]), at[i]) << "moved later, by itself";
    }
    EXPECT_TRUE(bench.bus.sync_running());
  }
}

}  // namespace
}  // namespace axisd::test
