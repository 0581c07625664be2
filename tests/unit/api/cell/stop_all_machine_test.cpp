#include "api/cell/stop_all_machine.hpp"

#include <gmock/gmock.h>

#include <array>
#include <random>
#include <set>
#include <string>

namespace axisd::cell {
namespace {

v1::StopAllLatch latch(const std::string& id, const std::string& by = "anna") {
  v1::StopAllLatch made;
  made.set_id(id);
  made.set_by(by);
  made.set_reason("because of " + id);
  made.mutable_at()->set_seconds(100);
  return made;
}

google::protobuf::Timestamp at(std::int64_t seconds) {
  google::protobuf::Timestamp time;
  time.set_seconds(seconds);
  return time;
}

TEST(StopAllMachine, StandsUntilItIsReleased) {
  StopAllMachine machine;
  EXPECT_FALSE(machine.stands());
  machine.stop(latch("1"));
  EXPECT_TRUE(machine.stands());
  EXPECT_EQ(machine.release("bert", at(200)).size(), 1U);
  EXPECT_FALSE(machine.stands());
  EXPECT_TRUE(machine.release("bert", at(201)).empty());
  EXPECT_EQ(machine.record().latches(0).released_by(), "bert");
}

TEST(StopAllMachine, WhoAsksAgainForTheSameReasonGetsTheLatchThatStands) {
  StopAllMachine machine;
  machine.stop(latch("1"));
  auto again = latch("2");
  again.set_reason("because of 1");
  EXPECT_EQ(machine.stop(again).id(), "1");
  EXPECT_EQ(machine.standing().size(), 1U);
}

TEST(StopAllMachine, EveryMachineThatIsNotInhibitedIsToldOnceForEachRunOfItsAxisd) {
  StopAllMachine machine;
  EXPECT_FALSE(machine.seen("press-2", "run-1", false)) << "nothing stands";
  machine.stop(latch("1"));
  EXPECT_TRUE(machine.seen("press-2", "run-1", false));
  EXPECT_FALSE(machine.seen("press-2", "run-1", false)) << "it is being told";
  EXPECT_TRUE(machine.told("press-2", "run-1"));
  EXPECT_FALSE(machine.seen("press-2", "run-1", false)) << "somebody released it there, by itself";
  EXPECT_TRUE(machine.seen("press-2", "run-2", false)) << "another run: nobody has looked at that";
}

TEST(StopAllMachine, AMachineThatCouldNotBeToldIsToldWhenItIsSeenAgain) {
  StopAllMachine machine;
  machine.stop(latch("1"));
  EXPECT_TRUE(machine.seen("press-2", "run-1", false));
  machine.not_told("press-2");
  EXPECT_TRUE(machine.seen("press-2", "run-1", false));
}

TEST(StopAllMachine, AMachineThatIsInhibitedAlreadyIsNotTold) {
  StopAllMachine machine;
  machine.stop(latch("1"));
  EXPECT_FALSE(machine.seen("press-2", "run-1", true));
  EXPECT_FALSE(machine.seen("press-2", "run-1", false)) << "it was latched, and was released there";
}

TEST(StopAllMachine, AnotherStopIsToldToEverybodyAgain) {
  StopAllMachine machine;
  machine.stop(latch("1"));
  (void)machine.told("press-2", "run-1");
  machine.stop(latch("2"));
  EXPECT_TRUE(machine.seen("press-2", "run-1", false));
}

TEST(StopAllMachine, AfterAReleaseNobodyIsTold) {
  StopAllMachine machine;
  machine.stop(latch("1"));
  machine.release("bert", at(200));
  EXPECT_FALSE(machine.seen("press-2", "run-1", false));
  EXPECT_FALSE(machine.told("press-2", "run-1")) << "an answer that was late";
}

TEST(StopAllMachine, AReleaseTakesBackNothingThatItsEntranceHadNotHeardOf) {
  StopAllMachine one, other;
  one.stop(latch("1"));
  (void)other.merge(one.record().latches());
  other.stop(latch("2", "carl"));
  one.release("bert", at(200));
  const auto merged = other.merge(one.record().latches());
  EXPECT_EQ(merged.ended.size(), 1U);
  EXPECT_TRUE(merged.other_lacks);
  EXPECT_TRUE(other.stands());
  (void)one.merge(other.record().latches());
  EXPECT_TRUE(one.stands());
  EXPECT_EQ(one.standing().front().id(), "2");
}

TEST(StopAllMachine, WhatIsKnownAlreadyChangesNothing) {
  StopAllMachine one, other;
  one.stop(latch("1"));
  EXPECT_EQ(other.merge(one.record().latches()).began.size(), 1U);
  const auto again = other.merge(one.record().latches());
  EXPECT_FALSE(again.changed());
  EXPECT_FALSE(again.other_lacks);
}

TEST(StopAllMachine, AReleaseThatComesFirstIsNoStop) {
  StopAllMachine one, other;
  one.stop(latch("1"));
  one.release("bert", at(200));
  EXPECT_FALSE(other.merge(one.record().latches()).changed());
  EXPECT_FALSE(other.stands());
}

/// Whatever the order in which entrances hear of each other: in the end all of them know the same, and it
/// stands what nobody who knew of it has released.
TEST(StopAllMachine, EntrancesAgreeInTheEnd) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::array<StopAllMachine, 3> entrances;
    std::set<std::string> standing;
    const auto any = [&] { return random() % entrances.size(); };
    for (int step = 0; step < 40; ++step) {
      switch (random() % 4) {
        case 0: {
          const auto id = std::to_string(seed) + "-" + std::to_string(step);
          entrances.at(any()).stop(latch(id, id));
          standing.insert(id);
          break;
        }
        case 1:
          for (const auto& each : entrances.at(any()).release("bert", at(step))) standing.erase(each.id());
          break;
        default:
          (void)entrances.at(any()).merge(entrances.at(any()).record().latches());
      }
    }
    for (int round = 0; round < 2; ++round)
      for (auto& one : entrances)
        for (const auto& other : entrances) (void)one.merge(other.record().latches());
    for (const auto& entrance : entrances) {
      std::set<std::string> known;
      for (const auto& each : entrance.standing()) known.insert(each.id());
      EXPECT_EQ(known, standing) << "seed " << seed;
    }
  }
}

TEST(StopAllMachine, ForgetsReleasedOnesAndNeverOneThatStands) {
  StopAllMachine machine;
  machine.stop(latch("first"));
  for (int i = 0; i < 300; ++i) {
    StopAllMachine other;
    other.stop(latch(std::to_string(i), std::to_string(i)));
    other.release("bert", at(i));
    (void)machine.merge(other.record().latches());
  }
  EXPECT_LE(machine.record().latches_size(), static_cast<int>(StopAllMachine::most));
  EXPECT_EQ(machine.standing().size(), 1U);
}

TEST(StopAllMachine, ManyStopsTakeABoundedRoom) {
  StopAllMachine machine;
  for (int i = 0; i < 1000; ++i) machine.stop(latch(std::to_string(i), std::to_string(i)));
  EXPECT_LE(machine.record().latches_size(), static_cast<int>(StopAllMachine::most));
  EXPECT_TRUE(machine.stands());
}

TEST(StopAllMachine, WhatNobodyCouldHaveWrittenIsNotTakenIn) {
  google::protobuf::RepeatedPtrField<v1::StopAllLatch> strange;
  *strange.Add() = latch("");
  *strange.Add() = latch(std::string(65, 'x'));
  *strange.Add() = latch("1", std::string(200, 'x'));
  StopAllMachine machine;
  EXPECT_FALSE(machine.merge(strange).changed());
}

TEST(StopAllMachine, ARestartKnowsWhomItHadTold) {
  StopAllMachine machine, restarted;
  machine.stop(latch("1"));
  (void)machine.told("press-2", "run-1");
  restarted.restore(machine.record_with_told());
  EXPECT_TRUE(restarted.stands());
  EXPECT_FALSE(restarted.seen("press-2", "run-1", false));
  EXPECT_TRUE(restarted.seen("press-3", "run-1", false));
}

}  // namespace
}  // namespace axisd::cell
