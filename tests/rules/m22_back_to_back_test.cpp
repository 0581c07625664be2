// Groups that start back to back: the members of one right behind each other, and one group as soon as the
// last has ended (M22).
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tests/rules/m22_group_rig.hpp"

namespace axisd::test {
namespace {

constexpr std::uint16_t block = 0x0020, trigger = 0x0027;

std::vector<std::string> names(const GroupRig& rig) {
  std::vector<std::string> all;
  for (const auto& axis : rig.configuration.axes) all.push_back(axis.axis.name);
  return all;
}

/// To and fro with all axes, each time in the moment in which the last move ends. `look` sees each of them.
void move_again_and_again(GroupRig& rig, int rounds, const std::function<void(const GroupMove&)>& look) {
  const auto axes = names(rig);
  for (int round = 0; round < rounds; ++round) {
    SCOPED_TRACE(round);
    std::map<std::string, double> places;
    for (const auto& axis : axes) places[axis] = round % 2 == 0 ? 2 : 1;
    std::map<std::string, int> starts;
    for (const auto& axis : axes) starts[axis] = rig.starts(axis);
    rig.line->forget_wire();
    const auto run = rig.move(GroupRig::to(places));
    ASSERT_TRUE(rig.run_until([&] { return ended(run->state()); }, 10s));
    const auto move = run->value();
    ASSERT_EQ(move.state, CommandState::done) << (move.cause ? to_string(*move.cause) : "");
    for (const auto& axis : axes) {
      EXPECT_EQ(rig.starts(axis), starts[axis] + 1) << axis;
      EXPECT_NEAR(rig.load_mm(axis), places[axis], 0.11) << axis;
    }
    look(move);
  }
}

/// Of as many members as start within the time for which those that have started are left alone.
TEST(M22BackToBack, OnALineNothingComesBetweenTheTriggers) {
  GroupRig rig({.can_axes = 0, .more_serial_axes = 10});
  const auto members = std::ssize(names(rig));
  ASSERT_EQ(members, 12);
  move_again_and_again(rig, 10, [&](const GroupMove& move) {
    const auto& wire = rig.line->wire();
    const auto is_trigger = [](const WireEntry& one) { return one.is_write() && one.address() == trigger; };
    const auto is_block = [](const WireEntry& one) { return one.is_write() && one.address() == block; };
    EXPECT_EQ(std::ranges::count_if(wire, is_block), members) << "no chain is tried twice";
    const auto first = std::ranges::find_if(wire, is_trigger);
    ASSERT_NE(first, wire.end());
    ASSERT_GE(wire.end() - first, members);
    EXPECT_TRUE(std::all_of(first, first + members, is_trigger));
    EXPECT_EQ(std::ranges::count_if(wire, is_trigger), members);
    const auto last = first + members - 1;
    ASSERT_TRUE(move.start_skew);
    EXPECT_EQ(*move.start_skew, last->end - first->end);
  });
}

TEST(M22BackToBack, OnCanEachTimeByOneSync) {
  GroupRig rig({.can_axes = 2});
  move_again_and_again(rig, 10, [](const GroupMove& move) {
    std::vector<WallTime> starts;
    for (const auto& member : move.members) {
      const bool on_can = member.command.axis == "z" || member.command.axis == "w";
      EXPECT_EQ(member.by_sync, on_can) << member.command.axis << ": " << member.note;
      if (on_can) starts.push_back(member.command.started_at.value());
    }
    ASSERT_EQ(starts.size(), 2U);
    EXPECT_EQ(starts[0], starts[1]);
  });
}

/// A stop between two of them ends what was asked for before it, and nothing of the next group waits for it.
TEST(M22BackToBack, AStopInTheMomentOfTheNextStartEndsIt) {
  for (const auto* stopped : {"x", "z"}) {
    SCOPED_TRACE(stopped);
    GroupRig rig({.can_axes = 2});
    const auto axes = names(rig);
    move_again_and_again(rig, 2, [](const GroupMove&) {});
    std::map<std::string, int> starts;
    for (const auto& axis : axes) starts[axis] = rig.starts(axis);
    const auto run = rig.move(GroupRig::to({{"x", 50}, {"y", 50}, {"z", 50}, {"w", 50}}));
    const auto stop = rig.machine->submit(stopped, StopRequest{}, {});
    ASSERT_TRUE(stop) << to_string(stop.error());
    ASSERT_TRUE(rig.run_until([&] { return ended(run->state()); }, 10s));
    EXPECT_EQ(run->state(), CommandState::aborted);
    rig.run(1s);
    for (const auto& axis : axes) EXPECT_EQ(rig.starts(axis), starts[axis]) << axis;
    EXPECT_TRUE(rig.rests(2s));
  }
}

}  // namespace
}  // namespace axisd::test
