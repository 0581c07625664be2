// Readings put together from PDOs, and the end of a homing.
#include <gtest/gtest.h>

#include <utility>

#include "devices/cia402/homing_watch.hpp"
#include "devices/cia402/state_pdos.hpp"
#include "devices/yss_c/model.hpp"

namespace axisd::cia402 {
namespace {

using namespace std::chrono_literals;
constexpr TimePoint start{std::chrono::hours(1)};

const Model& model() { return yss_c::model(); }

TEST(StateLayout, OfTheYssCIsTwoPdos) {
  const auto layout = state_layout(model());
  ASSERT_EQ(layout.size(), 2U);
  EXPECT_EQ(layout[0], (canopen::PdoMapping{{{0x6041, 0}, 16}, {{0x6064, 0}, 32}, {{0x2002, 0}, 16}}));
  EXPECT_EQ(layout[1],
            (canopen::PdoMapping{{{0x603F, 0}, 16}, {{0x2003, 0}, 16}, {{0x2004, 0}, 16}, {{0x6061, 0}, 8}}));
}

StatePdos pdos(bool synchronous) {
  StatePdos all;
  all.begin(model(), state_layout(model()), synchronous);
  return all;
}

/// Status word 0x2027, the position, -100 r/min.
std::vector<std::uint8_t> first(std::int32_t position) {
  const auto bits = static_cast<std::uint32_t>(position);
  return {0x27,
          0x20,
          static_cast<std::uint8_t>(bits),
          static_cast<std::uint8_t>(bits >> 8U),
          static_cast<std::uint8_t>(bits >> 16U),
          static_cast<std::uint8_t>(bits >> 24U),
          0x9C,
          0xFF};
}
const std::vector<std::uint8_t> second{0x02, 0xFF, 0x05, 0x00, 0x01, 0x00, 0x03};

TEST(StatePdos, ByEventAReadingIsAsOldAsItsOldestPart) {
  auto all = pdos(false);
  EXPECT_FALSE(all.on_pdo(0, first(-7), start, start + 1ms));
  EXPECT_FALSE(all.since(start));
  EXPECT_TRUE(all.on_pdo(1, second, start + 5ms, start + 6ms));
  ASSERT_TRUE(all.since(start));
  EXPECT_EQ(all.since(start)->asked_at, start);
  EXPECT_EQ(all.since(start)->measured_at, start + 6ms);
  EXPECT_FALSE(all.since(start + 1ms));
  EXPECT_TRUE(all.on_pdo(0, first(-8), start + 9ms, start + 10ms));
  EXPECT_TRUE(all.since(start + 5ms));
  const auto sample = decode_state(model(), 1000, all.since(start + 5ms)->values);
  EXPECT_EQ(sample.position_pulses, -8);
  EXPECT_EQ(sample.velocity_rpm, -100);
  EXPECT_TRUE(sample.moving);
  EXPECT_TRUE(sample.enabled);
  EXPECT_EQ(sample.alarm_code, 2);
  EXPECT_EQ(sample.inputs, 5U);
  EXPECT_EQ(sample.outputs, 1U);
}

TEST(StatePdos, WithSyncAReadingIsAsOldAsItsSync) {
  auto all = pdos(true);
  EXPECT_FALSE(all.on_pdo(0, first(1), start, start));
  EXPECT_FALSE(all.on_pdo(1, second, start, start));
  EXPECT_FALSE(all.since(start - 1s)) << "of no SYNC";
  all.on_sync(start + 10ms);
  EXPECT_FALSE(all.on_pdo(1, second, start + 11ms, start + 12ms));
  EXPECT_FALSE(all.since(start));
  EXPECT_TRUE(all.on_pdo(0, first(2), start + 12ms, start + 13ms));
  ASSERT_TRUE(all.since(start + 10ms));
  EXPECT_EQ(all.since(start)->asked_at, start + 10ms);
  // One that is missing may come in the next cycle: then it is that old.
  all.on_sync(start + 20ms);
  EXPECT_FALSE(all.on_pdo(0, first(3), start + 21ms, start + 21ms));
  all.on_sync(start + 30ms);
  EXPECT_FALSE(all.on_pdo(0, first(4), start + 31ms, start + 31ms));
  EXPECT_TRUE(all.on_pdo(1, second, start + 32ms, start + 32ms));
  EXPECT_EQ(all.since(start)->asked_at, start + 20ms);
  // A drive that needs longer than a period stays that late, though each cycle is complete.
  all.on_sync(start + 40ms);
  EXPECT_FALSE(all.on_pdo(0, first(5), start + 41ms, start + 41ms));
  EXPECT_TRUE(all.on_pdo(1, second, start + 42ms, start + 42ms));
  EXPECT_EQ(all.since(start)->asked_at, start + 30ms);
  // Until it sends twice in one cycle.
  EXPECT_TRUE(all.on_pdo(0, first(6), start + 48ms, start + 48ms));
  EXPECT_TRUE(all.on_pdo(1, second, start + 49ms, start + 49ms));
  EXPECT_EQ(all.since(start)->asked_at, start + 40ms);
}

TEST(StatePdos, ShortOnesAreNoReading) {
  auto all = pdos(false);
  EXPECT_FALSE(all.on_pdo(0, std::vector<std::uint8_t>{1, 2, 3}, start, start));
  EXPECT_FALSE(all.on_pdo(1, second, start, start));
  EXPECT_FALSE(all.since(start));
}

DriveSample at(Duration after, bool moving, bool homed, std::int32_t position = 0) {
  DriveSample sample;
  sample.asked_at = start + after;
  sample.moving = moving;
  sample.homed = homed;
  sample.enabled = true;
  sample.position_pulses = position;
  return sample;
}

constexpr std::int32_t away = 5000;  ///< where the motor stood
constexpr std::int32_t offset = 100;

/// With the bit's own level, as drives have it that report it at all times.
bool goes_on(HomingWatch& watch, const DriveSample& sample) {
  return watch.goes_on(sample, {.low = !sample.homed});
}

TEST(HomingWatch, EndsWithTheRiseOfTheBit) {
  HomingWatch watch;
  watch.begin(start, {.from = away, .offset = offset});
  EXPECT_TRUE(goes_on(watch, at(-1ms, false, true))) << "from before";
  EXPECT_TRUE(goes_on(watch, at(10ms, true, false)));
  EXPECT_TRUE(goes_on(watch, at(20ms, false, false))) << "a pause between two phases";
  EXPECT_TRUE(goes_on(watch, at(30ms, true, false)));
  EXPECT_TRUE(goes_on(watch, at(40ms, true, true))) << "still moving";
  EXPECT_FALSE(goes_on(watch, at(50ms, false, true)));
  EXPECT_FALSE(watch.active());
  EXPECT_TRUE(watch.reached());
}

TEST(HomingWatch, ABitOfTheLastTimeIsNoEnd) {
  for (const std::int32_t end : {0, offset, -offset, 60}) {
    HomingWatch watch;
    watch.begin(start, {.from = away, .offset = offset, .window = 1});
    EXPECT_TRUE(goes_on(watch, at(10ms, false, true, away)));
    EXPECT_TRUE(goes_on(watch, at(20ms, true, true, 50)));
    EXPECT_TRUE(goes_on(watch, at(30ms, false, true, end)));
    EXPECT_TRUE(goes_on(watch, at(400ms, false, true, end + 1))) << "within the window of the drive";
    EXPECT_FALSE(goes_on(watch, at(530ms, false, true, end))) << "it rests for good";
    EXPECT_EQ(watch.reached(), end != 60) << end << ": home is only where a homing leaves the counter";
  }
}

TEST(HomingWatch, AStartThatTheDriveIgnoredReachesNothing) {
  for (const std::int32_t where : {0, away}) {
    HomingWatch watch;
    watch.begin(start, {.from = where, .offset = offset});
    EXPECT_TRUE(goes_on(watch, at(10ms, false, true, where)));
    EXPECT_FALSE(goes_on(watch, at(520ms, false, true, where)));
    EXPECT_FALSE(watch.reached());
  }
}

/// It has no motion to show: that the counter is 0 there is all that there is of it.
TEST(HomingWatch, HomeWhereTheMotorStandsNeedsNoMotion) {
  for (const auto& [where, window] : {std::pair(0, 0), std::pair(away, 0), std::pair(0, 100),
                                      std::pair(8, 100), std::pair(40, 100), std::pair(away, 100)}) {
    HomingWatch watch;
    watch.begin(start, {.from = where, .braking = 50, .window = window, .in_place = true});
    EXPECT_TRUE(goes_on(watch, at(10ms, false, true, where)));
    EXPECT_FALSE(goes_on(watch, at(520ms, false, true, where)));
    EXPECT_EQ(watch.reached(), where <= 8) << where << ": ignored, with the counter as it was";
  }
}

TEST(HomingWatch, AwayFromHomeABitThatRoseIsWaitedFor) {
  HomingWatch watch;
  watch.begin(start, {.from = away, .offset = offset});
  EXPECT_TRUE(goes_on(watch, at(10ms, true, false, 4000)));
  EXPECT_TRUE(goes_on(watch, at(20ms, false, true, 3000))) << "it may be a pause";
  EXPECT_FALSE(goes_on(watch, at(530ms, false, true, 3000)));
  EXPECT_TRUE(watch.reached());
}

TEST(HomingWatch, NothingIsHomeWhereAStopTerminalWasActive) {
  HomingWatch watch;
  watch.begin(start, {.from = away, .offset = offset});
  EXPECT_TRUE(goes_on(watch, at(10ms, true, false, 4000)));
  EXPECT_TRUE(watch.goes_on(at(20ms, true, false, 3000), {.low = true, .held_up = true}));
  EXPECT_TRUE(goes_on(watch, at(30ms, false, true, 2990)));
  EXPECT_FALSE(goes_on(watch, at(540ms, false, true, 2990)));
  EXPECT_FALSE(watch.reached());
}

/// A stop that nobody saw, and CiA 402's bit of the last time: low while the motor turns, high at rest.
TEST(HomingWatch, ABitThatIsTiedToRestCountsWhereAHomingEnds) {
  constexpr std::int32_t braking = 40;
  for (const std::int32_t end : {3000, offset + braking + 20, braking, 0, offset, -offset - braking}) {
    HomingWatch watch;
    watch.begin(start, {.from = away, .offset = offset, .braking = braking, .tied_to_rest = true});
    EXPECT_TRUE(goes_on(watch, at(10ms, true, false, 4000)));
    EXPECT_TRUE(goes_on(watch, at(20ms, false, false, end))) << "the bit comes a cycle later";
    EXPECT_TRUE(goes_on(watch, at(40ms, false, true, end)));
    EXPECT_FALSE(goes_on(watch, at(530ms, false, true, end)));
    EXPECT_EQ(watch.reached(), end != 3000 && end != offset + braking + 20) << end;
  }
}

TEST(HomingWatch, ABitThatIsLowInAPauseIsNotTiedToRest) {
  HomingWatch watch;
  watch.begin(start, {.from = away, .offset = offset, .tied_to_rest = true});
  EXPECT_TRUE(goes_on(watch, at(10ms, true, false, 4000)));
  EXPECT_TRUE(goes_on(watch, at(20ms, false, false, 3000)));
  EXPECT_TRUE(goes_on(watch, at(80ms, false, false, 3000)));
  EXPECT_TRUE(goes_on(watch, at(120ms, true, false, 3500)));
  EXPECT_FALSE(goes_on(watch, at(200ms, false, true, 0)));
  EXPECT_TRUE(watch.reached());
}

/// At counter 0, and between two samples: nothing but the bit tells of it, and that was low before.
TEST(HomingWatch, OneThatIsOverBeforeItIsReadIsHomeWhereItsBitHasRisen) {
  for (const bool was_low : {false, true}) {
    HomingWatch watch;
    watch.begin(start, {.from = 0, .was_low = was_low});
    EXPECT_EQ(goes_on(watch, at(20ms, false, true, 0)), !was_low);
    if (!was_low) EXPECT_FALSE(goes_on(watch, at(530ms, false, true, 0)));
    EXPECT_EQ(watch.reached(), was_low);
  }
  HomingWatch ignored;
  ignored.begin(start, {.from = 0, .was_low = true});
  EXPECT_TRUE(goes_on(ignored, at(20ms, false, false, 0)));
  EXPECT_FALSE(goes_on(ignored, at(530ms, false, false, 0)));
  EXPECT_FALSE(ignored.reached()) << "the drive does not home";
}

/// With the bit of the last time: it was seen to begin.
TEST(HomingWatch, OneThatIsOverBeforeItIsReadIsHomeWhereItWasSeenToBegin) {
  for (const std::int32_t end : {0, 3000}) {
    HomingWatch watch;
    watch.begin(start, {.from = end});
    watch.note_begun();
    EXPECT_TRUE(goes_on(watch, at(20ms, false, true, end)));
    EXPECT_FALSE(goes_on(watch, at(530ms, false, true, end)));
    EXPECT_EQ(watch.reached(), end == 0) << end;
  }
}

TEST(HomingWatch, EndsAtRestWhereTheDriveSaysThatItFailed) {
  HomingWatch watch;
  watch.begin(start, {.from = away, .offset = offset});
  EXPECT_TRUE(watch.goes_on(at(10ms, false, false, away), {.low = true, .failed = true}))
      << "of the last one";
  EXPECT_TRUE(watch.goes_on(at(20ms, true, false, 4000), {.low = true}));
  EXPECT_TRUE(watch.goes_on(at(200ms, false, false, 3000), {.low = true, .failed = true}));
  EXPECT_FALSE(watch.goes_on(at(260ms, false, false, 3000), {.low = true, .failed = true}));
  EXPECT_FALSE(watch.reached());
}

TEST(HomingWatch, EndsWhenThePowerStageIsReleased) {
  HomingWatch watch;
  watch.begin(start, {.offset = offset});
  auto sample = at(10ms, true, false);
  sample.enabled = false;
  EXPECT_FALSE(goes_on(watch, sample));
  EXPECT_FALSE(watch.reached());
}

TEST(Decoding, InHomingTheStateTellsWhetherPowerIsOn) {
  Values values{{0x604100, 0x0027}, {0x606100, 6}};
  EXPECT_TRUE(decode_state(model(), 1000, values).enabled);
  values[0x606100] = 1;
  EXPECT_FALSE(decode_state(model(), 1000, values).enabled);
  values[0x604100] = 0x2023;
  EXPECT_TRUE(decode_state(model(), 1000, values).enabled) << "07h energises already (6.2.2)";
}

TEST(Decoding, AlarmsAreTheLowByteOfTheMakersCodes) {
  EXPECT_EQ(alarm_of(model(), 0xFF05), 5);
  EXPECT_EQ(alarm_of(model(), 0x0000), 0);
  EXPECT_EQ(alarm_of(model(), 0x2310), 0x2310);
  const Values fault{{0x604100, 0x0008}};
  EXPECT_EQ(decode_state(model(), 1000, fault).alarm_code, 0xFFFF) << "a fault without a code";
}

/// CiA 402: 603Fh holds the last error, also when the drive has left Fault.
TEST(Decoding, ByCia402TheStateAloneTellsOfAnAlarm) {
  auto standard = model();
  standard.status = {};
  standard.meaning = {};
  Values values{{0x603F00, 0x8611}};
  for (const std::int64_t word : {0x0040, 0x0021, 0x0023, 0x0027, 0x0007}) {
    values[0x604100] = word;
    EXPECT_EQ(decode_state(standard, 1000, values).alarm_code, 0) << word;
  }
  for (const std::int64_t word : {0x0008, 0x000F, 0x0018}) {
    values[0x604100] = word;
    EXPECT_EQ(decode_state(standard, 1000, values).alarm_code, 0x8611) << word;
  }
  values[0x603F00] = 0;
  EXPECT_EQ(decode_state(standard, 1000, values).alarm_code, alarm_without_code);
  const Values of_the_yss_c{{0x604100, 0x0040}, {0x603F00, 0xFF02}};
  EXPECT_EQ(decode_state(model(), 1000, of_the_yss_c).alarm_code, 2) << "there 0 is no alarm (7)";
}

TEST(Encoding, ForDrivesWithRatesAndPulsesPerSecond) {
  auto other = model();
  other.meaning.units = {
      .velocity = pulses_per_second, .ramps = Ramps::rates, .acceleration = pulses_per_second};
  other.objects.start_speed.reset();
  const MoveProfile profile{
      .target_pulses = -5, .velocity_rpm = 60, .acceleration_time = 100ms, .deceleration_time = 0ms};
  EXPECT_EQ(encode(other, 4000, profile), (MotionBlock{-5, 4000, 40'000, 4'000'000, 0}));
  EXPECT_EQ(encode(model(), 4000, profile), (MotionBlock{-5, 60, 100, 0, 5}));
  EXPECT_EQ(default_block(model()), (MotionBlock{5000, 120, 100, 100, 5}));
}

}  // namespace
}  // namespace axisd::cia402
