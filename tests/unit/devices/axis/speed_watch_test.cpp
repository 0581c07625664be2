#include "devices/axis/speed_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = SpeedWatch::State;

constexpr double revolution = 1000;
constexpr double fastest = 2000;  // 120 r/min
constexpr auto period = 20ms;
constexpr auto reply = 5ms;

/// A watch, and a shaft whose position (pulses, by seconds since the start) it reads.
struct Bench {
  using Shaft = std::function<double(double)>;

  explicit Bench(double velocity = fastest, std::int32_t at = 0) : origin(at) {
    watch.begin({.asked_at = now, .measured_at = now + reply, .pulses = at}, velocity);
  }

  /// Reads until it is found too fast. How long that takes; nothing: not in that time.
  std::optional<Duration> run(const Shaft& shaft, Duration longest, Duration every = period,
                              Duration takes = reply) {
    const auto end = now + longest;
    while (now < end) {
      now += every;
      if (read(shaft(seconds(now + (takes / 2))), takes)) return now - begin;
    }
    return std::nullopt;
  }
  bool read(double pulses, Duration takes = reply) { return watch.follow(reading(pulses, takes)); }
  [[nodiscard]] SpeedWatch::Reading reading(double pulses, Duration takes = reply) const {
    const auto counter = static_cast<std::uint32_t>(origin) +
                         static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(pulses)));
    return {.asked_at = now,
            .measured_at = now + takes,
            .pulses = static_cast<std::int32_t>(counter),
            .moving = true};
  }
  [[nodiscard]] double seconds(TimePoint at) const {
    return std::chrono::duration<double>(at - begin).count();
  }

  std::int32_t origin;
  TimePoint begin{10s}, now = begin;
  SpeedWatch watch{revolution};
};

Bench::Shaft steady(double velocity) {
  return [velocity](double t) { return velocity * t; };
}

TEST(SpeedWatch, NothingIsFollowedAtFirst) {
  SpeedWatch watch(revolution);
  EXPECT_EQ(watch.state(), State::resting);
  EXPECT_FALSE(watch.follow({.asked_at = TimePoint(1s), .measured_at = TimePoint(1s), .pulses = 1'000'000}));
  EXPECT_FALSE(watch.arrive({.asked_at = TimePoint(2s), .measured_at = TimePoint(2s), .pulses = 2'000'000}));
  EXPECT_EQ(watch.state(), State::resting);
}

TEST(SpeedWatch, RestingFollowing) {
  const Bench bench;
  EXPECT_EQ(bench.watch.state(), State::following);
  EXPECT_EQ(bench.watch.fastest(), fastest);
}

TEST(SpeedWatch, FollowingDoubted) {
  Bench bench;
  bench.now += period;
  EXPECT_FALSE(bench.read(10'000));
  EXPECT_EQ(bench.watch.state(), State::doubted);
}

TEST(SpeedWatch, DoubtedTooFast) {
  Bench bench;
  EXPECT_EQ(bench.run(steady(90 * fastest), 1s), 2 * period);
  EXPECT_EQ(bench.watch.state(), State::too_fast);
  EXPECT_GT(bench.watch.seen(), 60 * fastest);
  EXPECT_LE(bench.watch.seen(), 90 * fastest) << "it is said to be at least so fast";
}

/// A counter that was set, or one reading that is wrong: neither goes on.
TEST(SpeedWatch, DoubtedFollowing) {
  for (const double jump : {100'000.0, -100'000.0})
    for (const bool stays : {true, false}) {
      Bench bench;
      const auto shaft = [&](double t) {
        const bool jumped = stays ? t > 0.1 : t > 0.1 && t < 0.12;
        return (fastest * t) + (jumped ? jump : 0);
      };
      EXPECT_FALSE(bench.run(shaft, 95ms));
      EXPECT_EQ(bench.watch.state(), State::doubted);
      EXPECT_FALSE(bench.run(shaft, 10s));
      EXPECT_EQ(bench.watch.state(), State::following);
    }
}

TEST(SpeedWatch, AnythingResting) {
  Bench bench;
  EXPECT_FALSE(bench.run(steady(90 * fastest), period));
  ASSERT_EQ(bench.watch.state(), State::doubted);
  bench.watch.rest(bench.reading(20'000));
  EXPECT_EQ(bench.watch.state(), State::resting);
  EXPECT_FALSE(bench.run(steady(90 * fastest), 1s)) << "that is not ours";
}

TEST(SpeedWatch, TooFastFollowing) {
  Bench bench;
  ASSERT_TRUE(bench.run(steady(90 * fastest), 1s));
  EXPECT_FALSE(bench.run(steady(90 * fastest), 1s)) << "it is told once";
  bench.watch.begin(bench.reading(0), fastest);
  EXPECT_EQ(bench.watch.state(), State::following);
}

TEST(SpeedWatch, FollowingTooFastByTheWholeWay) {
  Bench bench;
  bench.now += 150ms;
  EXPECT_TRUE(bench.watch.arrive(bench.reading(2000))) << "which takes a second";
  EXPECT_EQ(bench.watch.state(), State::too_fast);
  EXPECT_NEAR(bench.watch.seen(), 2000 / 0.155, 1);
}

TEST(SpeedWatch, DoubtedTooFastByTheWholeWay) {
  Bench bench;
  bench.now += period;
  ASSERT_FALSE(bench.read(2000));
  ASSERT_EQ(bench.watch.state(), State::doubted);
  EXPECT_TRUE(bench.watch.arrive(bench.reading(2000)));
}

TEST(SpeedWatch, AWayOfWhichNothingCanBeSaidIsNoFault) {
  for (const double pulses : {0.0, 1.0, 200.0, -200.0}) {
    Bench bench;
    bench.now += 10ms;
    EXPECT_FALSE(bench.watch.arrive(bench.reading(pulses)));
    EXPECT_EQ(bench.watch.state(), State::following);
  }
}

TEST(SpeedWatch, FindsTwiceAsFastAndTheOtherWay) {
  for (const double factor : {2.0, -2.0, 90.0, -90.0}) {
    Bench bench;
    EXPECT_TRUE(bench.run(steady(factor * fastest), 700ms)) << factor;
  }
}

TEST(SpeedWatch, FindsOneThatBecomesTooFastAfterAnHour) {
  Bench bench;
  ASSERT_FALSE(bench.run(steady(fastest), 1h));
  const auto at = bench.seconds(bench.now);
  const auto shaft = [&](double t) { return (fastest * at) + (2 * fastest * (t - at)); };
  EXPECT_TRUE(bench.run(shaft, 1500ms));
}

/// Readings that come one right behind the other, each of them long: on a slow line.
TEST(SpeedWatch, WhatReadingsTakeDoesNotAddUp) {
  Bench bench;
  EXPECT_TRUE(bench.run(steady(2 * fastest), 800ms, 30ms, 30ms));
}

TEST(SpeedWatch, TheCounterMayWrap) {
  for (const double direction : {1.0, -1.0}) {
    const auto at = direction > 0 ? std::numeric_limits<std::int32_t>::max() - 500
                                  : std::numeric_limits<std::int32_t>::min() + 500;
    Bench slow(fastest, at);
    EXPECT_FALSE(slow.run(steady(direction * fastest), 2s));
    Bench fast(fastest, at);
    EXPECT_TRUE(fast.run(steady(direction * 90 * fastest), 1s));
  }
}

/// Noise, play, ramps, readings that come late or are old, and stamps that lie about as much as they may.
TEST(SpeedWatch, NeverFindsOneThatIsAsFastAsTold) {
  std::mt19937 random(11);  // NOLINT(*-msc51-cpp): the same each time
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  for (int run = 0; run < 300; ++run) {
    const auto velocity = std::pow(10.0, between(0.5, 4.7));
    Bench bench(velocity);
    double position = 0, told = bench.seconds(bench.now), speed = 0;
    for (int i = 0; i < 500; ++i) {
      const bool stalls = i % 50 == 49;
      bench.now += Duration(std::chrono::microseconds(std::lround(1e3 * between(2, stalls ? 400 : 40))));
      const Duration takes = std::chrono::microseconds(std::lround(1e3 * between(1, stalls ? 300 : 30)));
      // Anywhere within the reading, and a little before.
      const auto in_it = between(-0.02, bench.seconds(bench.begin + takes));
      const auto at = std::max(told, bench.seconds(bench.now) + in_it);
      if (i % 20 == 0) speed = between(-1, 1) < 0.7 ? velocity : -velocity * between(0, 1);
      position += speed * (at - told);
      told = at;
      ASSERT_FALSE(bench.read(position + std::lround(between(-2, 2)), takes)) << run << " " << i;
    }
  }
}

/// It fell behind by as much as a drive lets it, and catches up at once.
TEST(SpeedWatch, MayCatchUpARevolution) {
  for (const double velocity : {10.0, 200.0, 20'000.0}) {
    Bench bench(velocity);
    const auto held = std::max(0.2, 0.99 * revolution / velocity);
    const auto shaft = [&](double t) {
      if (t < 0.1) return velocity * t;
      const auto lag = std::min(velocity * (t - 0.1), 0.99 * revolution);
      if (t < held) return (velocity * t) - lag;
      const auto left = std::min(velocity * (held - 0.1), 0.99 * revolution);
      return (velocity * t) - (left * std::exp(-(t - held) / 0.04));
    };
    EXPECT_FALSE(bench.run(shaft, std::chrono::milliseconds(std::lround(1e3 * held)) + 1s)) << velocity;
  }
}

/// It comes to where a fast motion left it while a slow one begins.
TEST(SpeedWatch, AMotionMayBeginWhileTheOneBeforeSettles) {
  Bench bench(20'000);
  bench.watch.rest(bench.reading(0));
  bench.now += 50ms;
  bench.watch.begin(bench.reading(0), 20);
  const auto settled = [&](double t) { return 900 * (1 - std::exp(-(t - 0.05) / 0.04)); };
  EXPECT_FALSE(bench.run(settled, 2s));
  EXPECT_FALSE(bench.watch.arrive(bench.reading(900)));
}

}  // namespace
}  // namespace axisd
