// What goes on by itself once it has started, and releases: in order, and never late.
#include "axisd/v1/group_service.pb.h"
#include "axisd/v1/system_service.pb.h"
#include "tests/unit/web/lane_test.hpp"

namespace axisd::web {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class LaneStart : public LaneTest {
 protected:
  static v1::MoveAbsoluteRequest request(const std::string& axis = "feeder") {
    v1::MoveAbsoluteRequest request;
    request.set_axis(axis);
    request.mutable_options()->mutable_not_after()->set_seconds(1);
    return request;
  }
  void move(Duration late = {}, const std::string& axis = "feeder") {
    say("axisd.v1.AxisService/MoveAbsolute", request(axis).SerializeAsString(), late);
  }
  void move_group(std::initializer_list<const char*> axes) {
    v1::MoveGroupRequest request;
    for (const auto* axis : axes) request.add_targets()->set_axis(axis);
    request.mutable_options()->mutable_not_after()->set_seconds(1);
    say("axisd.v1.GroupService/MoveGroup", request.SerializeAsString());
  }
  void release_all(Duration late = {}) { say("axisd.v1.SystemService/ReleaseStopAll", "", late); }
  /// The axes of the gateway's own Halts.
  [[nodiscard]] std::vector<std::string> halted(std::size_t from) const {
    std::vector<std::string> axes;
    for (auto i = from; i < messages.size(); ++i) {
      v1::HaltRequest halt;
      EXPECT_TRUE(halt.ParseFromString(messages[i]));
      axes.push_back(halt.axis());
    }
    return axes;
  }
};

TEST_F(LaneStart, IsPassedOnAndAnswered) {
  move();
  answer(0);
  EXPECT_THAT(taken(), ElementsAre("MoveAbsolute", "answer"));
  EXPECT_EQ(patience.at(0), LaneState::patience_of_starts);
  EXPECT_EQ(feeder(), Jogging::none) << "it goes on by itself";
  wait(10s);
  EXPECT_THAT(taken(), IsEmpty());
}

TEST_F(LaneStart, ThatWasHeldUpIsDropped) {
  move(LaneState::latest + 50ms);
  EXPECT_THAT(taken(), ElementsAre("late"));
  release_all(LaneState::latest + 50ms);
  EXPECT_THAT(taken(), ElementsAre("late"));
}

TEST(LaneStartMeasure, WaitsUntilItIsKnownHowLongTheLaneTakes) {
  LaneState lane([] { return std::uint64_t{1}; });
  std::string bytes(1, '\1');
  append_big_endian32(bytes, 1);
  append_big_endian32(bytes, 1);
  constexpr std::string_view method = "axisd.v1.SystemService/ReleaseStopAll";
  bytes += static_cast<char>(method.size());
  bytes += method;
  const auto effects = lane.receive(bytes, TimePoint(1h));
  ASSERT_EQ(effects.size(), 1U);
  EXPECT_EQ(std::get<LaneSend>(effects.front()).bytes.front(), '\4');
}

TEST_F(LaneStart, IsRefusedWhereItDoesNotSayHowLongItIsValid) {
  auto undated = request();
  undated.mutable_options()->clear_not_after();
  auto waiting = request();
  waiting.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
  for (const auto& message : {undated, waiting, request("")}) {
    say("axisd.v1.AxisService/MoveAbsolute", message.SerializeAsString());
    EXPECT_THAT(taken(), ElementsAre("refused"));
  }
  for (const auto* name : {"Enable", "Home", "MoveRelative", "MoveVelocity", "Reset", "SetPosition"}) {
    say("axisd.v1.AxisService/" + std::string(name), "\xFF");
    EXPECT_THAT(taken(), ElementsAre("refused")) << name;
  }
  move_group({});
  EXPECT_THAT(taken(), ElementsAre("refused"));
}

TEST_F(LaneStart, IsHaltedBehindItsAnswerWhereAStopCameBehindIt) {
  for (const auto* kind : {"Halt", "Stop", "QuickStop"}) {
    const auto first = numbers.size();
    move();
    stop(kind);
    EXPECT_THAT(taken(), ElementsAre("MoveAbsolute", kind)) << "a stop waits for nothing";
    answer(first + 1);
    answer(first);
    EXPECT_THAT(taken(), ElementsAre("answer", "answer", "Halt"));
    EXPECT_THAT(halted(first + 2), ElementsAre("feeder"));
  }
}

TEST_F(LaneStart, ThatIsRefusedNeedsNoHalt) {
  move();
  stop();
  (void)taken();
  fail(0, code::failed_precondition, "details");
  EXPECT_THAT(taken(), ElementsAre("answer"));
  wait(1s);
  EXPECT_THAT(taken(), IsEmpty());
}

TEST_F(LaneStart, WhoseAnswerIsLostIsHaltedTwice) {
  move();
  stop();
  (void)taken();
  fail(0, code::deadline_exceeded);
  EXPECT_THAT(taken(), ElementsAre("answer", "Halt"));
  wait(LaneState::pause);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneStart, OfAnotherAxisGoesOn) {
  move({}, "lifter");
  stop();
  answer(0);
  EXPECT_THAT(taken(), ElementsAre("MoveAbsolute", "Halt", "answer"));
}

TEST_F(LaneStart, BehindAStopGoesOn) {
  stop();
  move();
  answer(1);
  EXPECT_THAT(taken(), ElementsAre("Halt", "MoveAbsolute", "answer"));
}

TEST_F(LaneStart, OfAGroupIsHaltedAsAWhole) {
  move_group({"lifter", "feeder"});
  stop();
  answer(0);
  EXPECT_THAT(taken(), ElementsAre("MoveGroup", "Halt", "answer", "Halt", "Halt"));
  EXPECT_THAT(halted(2), ElementsAre("lifter", "feeder"));
}

TEST_F(LaneStart, IsHaltedWhereAStopOfManyCameBehindIt) {
  for (const auto* stop : {"axisd.v1.SystemService/StopAll", "axisd.v1.GroupService/GroupHalt"}) {
    const auto first = numbers.size();
    move();
    say(stop, "");
    answer(first);
    EXPECT_EQ(taken().back(), "Halt") << stop;
  }
}

TEST_F(LaneStart, WhosePageIsGoneIsHalted) {
  move();
  close();
  EXPECT_THAT(taken(), ElementsAre("MoveAbsolute"));
  EXPECT_FALSE(lane.at_rest());
  answer(0);
  EXPECT_THAT(taken(), ElementsAre("Halt")) << "nobody is told";
  answer(1);
  EXPECT_TRUE(lane.at_rest());
}

TEST_F(LaneStart, ThatWasAnsweredGoesOnWithoutItsPage) {
  move();
  answer(0);
  close();
  EXPECT_THAT(taken(), ElementsAre("MoveAbsolute", "answer"));
}

TEST_F(LaneStart, AReleaseUndoesNoStopAllThatCameBehindIt) {
  release_all();
  say("axisd.v1.SystemService/StopAll", "");
  EXPECT_THAT(taken(), ElementsAre("ReleaseStopAll", "StopAll"));
  answer(1);
  answer(0);
  EXPECT_THAT(taken(), ElementsAre("answer", "answer", "StopAll"));
  fail(2, code::unavailable);
  EXPECT_THAT(taken(), IsEmpty());
  wait(1s);
  EXPECT_THAT(taken(), IsEmpty());
  release_all();
  answer(3);
  EXPECT_THAT(taken(), ElementsAre("ReleaseStopAll", "answer"));
}

}  // namespace
}  // namespace axisd::web
