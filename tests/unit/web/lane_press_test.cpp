#include "tests/unit/web/lane_test.hpp"

namespace axisd::web {
namespace {

using testing::ElementsAre;

// What was refused stays refused.

TEST_F(LaneTest, APressThatWasRefusedNeverStarts) {
  for (const int why : {code::resource_exhausted, code::unavailable, code::failed_precondition}) {
    press = "press-" + std::to_string(why);
    jog();
    fail(numbers.size() - 1, why);
    (void)taken();
    jog();
    EXPECT_THAT(taken(), ElementsAre("refused"));
    wait(1s);
    jog();
    EXPECT_EQ(taken().back(), "refused");
  }
  press = "another";
  jog();
  EXPECT_THAT(taken(), ElementsAre("Jog"));
}

TEST_F(LaneTest, APressThatCameTooLateNeverStarts) {
  jog(300ms, 200ms);
  EXPECT_THAT(taken(), ElementsAre("late"));
  jog();
  EXPECT_THAT(taken(), ElementsAre("refused"));
  jog(300ms, {}, "lifter");
  EXPECT_THAT(taken(), ElementsAre("Jog")) << "another axis";
  stop();
  (void)taken();
  jog();
  EXPECT_THAT(taken(), ElementsAre("Jog")) << "behind a stop";
}

TEST_F(LaneTest, ALateRenewalOfWhatIsOnItsWayIsOnlyDropped) {
  jog();
  jog(300ms, 200ms);
  answer(0);
  (void)taken();
  jog();
  EXPECT_THAT(taken(), ElementsAre("Jog"));
}

TEST_F(LaneTest, APressThatStartsAfterItWasRefusedIsHalted) {
  jog();
  jog();
  (void)taken();
  fail(0, code::resource_exhausted);
  answer(1);
  EXPECT_THAT(taken(), ElementsAre("answer", "answer", "Halt"));
  EXPECT_EQ(feeder(), Jogging::none);
}

TEST_F(LaneTest, ARefusalOfAnotherPressLeavesWhatRuns) {
  run();
  press = "press-2";
  jog();
  fail(1, code::resource_exhausted);
  EXPECT_EQ(feeder(), Jogging::running);
  (void)taken();
  jog();
  EXPECT_THAT(taken(), ElementsAre("refused"));
  wait(300ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, RefusedPressesOfABoundedNumberOfAxesAreRemembered) {
  for (std::size_t i = 0; i < LaneState::most_barred + 10; ++i) {
    jog(300ms, 200ms, "axis-" + std::to_string(i));
    wait(20ms);
  }
  jog(300ms, {}, "axis-" + std::to_string(LaneState::most_barred + 9));
  EXPECT_EQ(taken().back(), "refused") << "the last ones";
}

// How late the first message is.

TEST(LaneMeasure, NothingStartsBeforeTheNumberOfAnEchoCameBack) {
  TimePoint now{Duration(1h)};
  std::uint64_t last = 7;
  LaneState lane([&] { return ++last; });
  std::uint32_t id = 0;
  std::string reply, number;
  const auto say = [&](std::string_view method, const std::string& message) {
    std::string bytes(1, '\1');
    append_big_endian32(bytes, ++id);
    append_big_endian32(bytes, static_cast<std::uint32_t>(now.time_since_epoch() / 1ms));
    bytes += static_cast<char>(method.size());
    bytes += method;
    bytes += message;
    const auto effects = lane.receive(bytes, now);
    const auto* sent = effects.empty() ? nullptr : std::get_if<LaneSend>(&effects.front());
    reply = sent == nullptr ? "passed on" : sent->bytes;
    if (method.empty()) number = reply.substr(reply.size() - 8);
  };
  v1::JogRequest jog;
  jog.set_axis("feeder");
  const auto press = [&] {
    jog.mutable_options()->set_request_id(std::to_string(id));
    say("axisd.v1.AxisService/Jog", jog.SerializeAsString());
    return reply == "passed on";
  };
  EXPECT_FALSE(press());
  EXPECT_EQ(reply.front(), '\4');
  say("axisd.v1.AxisService/Stop", "");
  EXPECT_EQ(reply, "passed on") << "stops wait for nothing";
  say("", "");
  EXPECT_FALSE(press()) << "the echo may have been on its way for long, and so may this";
  say("", "");
  const auto old = number;
  say("", "");
  say("", old);
  EXPECT_FALSE(press()) << "not the last one";
  now += LaneState::longest_round_trip + 1ms;
  say("", number);
  EXPECT_FALSE(press()) << "too slow to know it well";
  now += LaneState::longest_round_trip;
  say("", number);
  EXPECT_TRUE(press());
  say("axisd.v1.LeaseService/RenewLease", "");
  EXPECT_EQ(reply, "passed on");
}

}  // namespace
}  // namespace axisd::web
