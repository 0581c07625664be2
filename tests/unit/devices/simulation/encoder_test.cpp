// What an encoder shows of a motor: noise, following error, settling, resolution, play, a hand and a load.
#include "devices/simulation/encoder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "devices/simulation/motor.hpp"

namespace axisd::simulation {
namespace {

using namespace std::chrono_literals;

/// A motor in closed loop, its encoder, and the time that they live in.
struct Shaft {
  explicit Shaft(const EncoderSettings& settings, std::uint64_t seed = 1) : encoder(settings, seed) {
    motor.advance(now, true);
    motor.follow_within(settings.following);
  }
  void wait(Duration duration) { motor.advance(now += duration, true); }
  [[nodiscard]] std::int32_t position() const { return encoder.position(motor, now); }

  TimePoint now{1s};
  Motor motor;
  Encoder encoder;
};

constexpr Rates rates{.start = 500, .cruise = 10'000, .acceleration = 50'000, .deceleration = 50'000};

TEST(Encoder, IsTheCommandedPositionWhereNothingElseIsSaid) {
  Shaft shaft({});
  shaft.motor.move(5000, rates);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(shaft.motor.counter(), shaft.position());
    shaft.wait(1ms);
  }
  EXPECT_EQ(5000, shaft.position());
}

TEST(Encoder, ReadingsAtRestWaverByItsCountsAndNoMore) {
  for (const int noise : {0, 1, 2}) {
    Shaft shaft({.noise = noise});
    std::set<std::int32_t> seen;
    for (int i = 0; i < 1000; ++i) {
      seen.insert(shaft.position());
      shaft.wait(5ms);
    }
    EXPECT_EQ(static_cast<std::size_t>(2 * noise + 1), seen.size());
    EXPECT_EQ(-noise, *seen.begin());
    EXPECT_EQ(noise, *seen.rbegin());
  }
}

TEST(Encoder, AShaftThatHasSettledHasNoSpeed) {
  for (const Duration following : {Duration(1us), Duration(20us), Duration(3ms)}) {
    Shaft shaft({.following = following});
    shaft.motor.move(-5000, rates);
    shaft.wait(shaft.motor.ends() - shaft.now);  // a reading at its very end
    shaft.wait(200ms);
    EXPECT_NEAR(shaft.motor.shaft_speed(), 0, 1e-6) << following.count();
  }
}

TEST(Encoder, IsTheSameForTheSameSeedAndTimeHoweverOftenItIsRead) {
  const EncoderSettings settings{.noise = 2, .following = 8ms};
  Shaft one(settings, 7), other(settings, 7), foreign(settings, 8);
  for (auto* shaft : {&one, &other, &foreign}) shaft->motor.move(3000, rates);
  int differs = 0;
  for (int i = 0; i < 200; ++i) {
    for (int step = 0; step < 7; ++step) one.wait(1ms);
    other.wait(7ms);
    foreign.wait(7ms);
    EXPECT_EQ(one.position(), other.position());
    differs += foreign.position() != other.position() ? 1 : 0;
  }
  EXPECT_GT(differs, 50);
}

TEST(Encoder, IsBehindInProportionToTheSpeedAndSettlesAfterTheEnd) {
  Shaft shaft({.following = 8ms});
  shaft.motor.move(10'000, rates);
  shaft.wait(500ms);
  EXPECT_EQ(10'000, shaft.motor.speed());
  EXPECT_NEAR(80, shaft.motor.counter() - shaft.position(), 1) << "10000 pulses/s x 8 ms";
  while (shaft.motor.moving()) shaft.wait(1ms);
  const auto left = 10'000 - shaft.position();
  EXPECT_GT(left, 3) << "the pulses have ended, the shaft has not arrived";
  shaft.wait(8ms);
  EXPECT_NEAR(left / 2.718, 10'000 - shaft.position(), 1.5);
  shaft.wait(60ms);
  EXPECT_EQ(10'000, shaft.position());
}

TEST(Encoder, AnAbruptStopSettlesToo) {
  Shaft shaft({.following = 8ms});
  shaft.motor.run(-1, rates);
  shaft.wait(1s);
  shaft.motor.stop(false);
  EXPECT_NEAR(-80, shaft.motor.counter() - shaft.position(), 1);
  std::int32_t before = shaft.position();
  for (int i = 0; i < 100; ++i) {
    shaft.wait(1ms);
    EXPECT_LE(shaft.position(), before) << "it never turns back";
    before = shaft.position();
  }
  EXPECT_EQ(shaft.motor.counter(), shaft.position());
}

TEST(Encoder, NeverGoesBackwardsInAMotionForwards) {
  Shaft shaft({.following = 10ms});
  for (const double acceleration : {50'000.0, 1e12}) {
    shaft.motor.move(
        4000, {.start = 500, .cruise = 10'000, .acceleration = acceleration, .deceleration = acceleration});
    auto before = shaft.position();
    for (int i = 0; i < 1500; ++i) {
      shaft.wait(1ms);
      EXPECT_GE(shaft.position(), before - 1) << "pulses and lag are rounded each by itself";
      before = std::max(before, shaft.position());
    }
  }
  EXPECT_EQ(8000, shaft.position());
}

TEST(Encoder, ShowsWholeCountsOfItsResolution) {
  Shaft shaft({.quantised = true});
  shaft.encoder.set_resolution(2.5);  // 4000 counts for 10000 pulses
  shaft.motor.move(1001, rates);
  std::set<std::int32_t> rests;
  while (shaft.motor.moving()) {
    shaft.wait(1ms);
    rests.insert(shaft.position() % 5);
  }
  EXPECT_EQ(1000, shaft.position());
  EXPECT_EQ((std::set<std::int32_t>{0, 3}), rests) << "counts at 0, 2.5, 5 ...";
}

TEST(Encoder, TheNoiseIsInCounts) {
  Shaft shaft({.noise = 2});
  shaft.encoder.set_resolution(2.5);
  std::int32_t most = 0;
  for (int i = 0; i < 500; ++i) {
    shaft.wait(5ms);
    most = std::max(most, std::abs(shaft.position()));
  }
  EXPECT_EQ(5, most);
  shaft.encoder.set_resolution(0.25);
  most = 0;
  for (int i = 0; i < 500; ++i) {
    shaft.wait(5ms);
    most = std::max(most, std::abs(shaft.position()));
  }
  EXPECT_EQ(2, most) << "counts finer than pulses do not hide it";
}

TEST(Encoder, PlayLeavesTheShaftShortAfterAMotionBackwards) {
  Shaft shaft({.backlash = 3});
  const auto go = [&](std::int64_t distance) {
    shaft.motor.move(distance, rates);
    shaft.wait(5s);
    return shaft.position();
  };
  EXPECT_EQ(100, go(100));
  EXPECT_EQ(53, go(-50));
  EXPECT_EQ(60, go(10));
}

TEST(Encoder, AHandBendsTheShaftAsFarAsItGivesWay) {
  Shaft shaft({.compliance = 4});
  EXPECT_FALSE(shaft.encoder.lean(5));
  EXPECT_EQ(0, shaft.position());
  EXPECT_TRUE(shaft.encoder.lean(-4));
  EXPECT_EQ(-4, shaft.position());
  EXPECT_TRUE(shaft.encoder.lean(0));
  EXPECT_EQ(0, shaft.position());
}

TEST(Encoder, ALoadTurnsAReleasedShaft) {
  Encoder encoder({.slip = -200}, 1);
  TimePoint now{1s};
  EXPECT_EQ(0, encoder.slipped(now, false));
  std::int64_t total = 0;
  for (int i = 0; i <= 1000; ++i) total += encoder.slipped(now += 1ms, true);
  EXPECT_NEAR(-200, total, 1);
  EXPECT_EQ(0, encoder.slipped(now += 1s, false)) << "held";
  EXPECT_EQ(-2, encoder.slipped(now += 10ms, true));
}

}  // namespace
}  // namespace axisd::simulation
