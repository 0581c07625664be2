#include "devices/cia402/units.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "devices/cia402/unit_objects.hpp"

namespace axisd::cia402 {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Kind = UnitTold::Kind;

constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
constexpr std::uint32_t si_position = 0x60A800, si_velocity = 0x60A900, si_acceleration = 0x60AA00;

Rate named(std::string_view name) {
  const auto unit = unit_named(name);
  EXPECT_TRUE(unit) << name;
  return unit.value_or(Rate{});
}

TEST(Units, EachNameIsOneUnit) {
  std::set<std::string> texts;
  for (const auto name : unit_names) {
    EXPECT_EQ(name_of(named(name)), name);
    EXPECT_TRUE(texts.insert(text_of(named(name))).second) << name;
  }
  EXPECT_FALSE(unit_named("rpm/s"));
  EXPECT_EQ(name_of(Rate{.exponent = -6}), "");
  EXPECT_EQ(text_of(Rate{.exponent = -6}), "0.000001 r/min");
  EXPECT_EQ(text_of(Rate{.exponent = 2}), "100 r/min");
  EXPECT_EQ(text_of(named("0.1degrees_per_second")), "0.1 degrees/s");
  EXPECT_EQ(text_of(pulses_per_second), "pulses/s");
}

TEST(Units, ARampTakesTheLongerTheFewerItsCounts) {
  EXPECT_EQ(time_of_ramp(named("rpm"), 4000, 600, 300), 2s);
  EXPECT_EQ(time_of_ramp(named("rpm"), 4000, -600, 300), 2s);
  EXPECT_EQ(time_of_ramp(pulses_per_second, 1000, 600, 5000), 2s);
  EXPECT_EQ(time_of_ramp(named("0.1rev_per_second"), 1, 600, 50), 2s);
  EXPECT_EQ(time_of_ramp(pulses_per_second, 1000, 600, std::int64_t{0xFFFFFFFF}), 2329ns);
  EXPECT_EQ(time_of_ramp(pulses_per_second, most, most, 1), std::chrono::hours(24));
}

/// 120 r/min of a motor with 4000 pulses.
TEST(Units, EachUnitCountsTheSameMotion) {
  const std::pair<std::string_view, std::int32_t> cases[] = {{"pulses_per_second", 8000},
                                                             {"rpm", 120},
                                                             {"0.1rpm", 1200},
                                                             {"0.01rpm", 12'000},
                                                             {"0.001rpm", 120'000},
                                                             {"rev_per_second", 2},
                                                             {"0.1rev_per_second", 20},
                                                             {"0.01rev_per_second", 200},
                                                             {"0.001rev_per_second", 2000},
                                                             {"degrees_per_second", 720},
                                                             {"0.1degrees_per_second", 7200},
                                                             {"0.01degrees_per_second", 72'000},
                                                             {"0.001degrees_per_second", 720'000},
                                                             {"radians_per_second", 12},
                                                             {"0.1radians_per_second", 125},
                                                             {"0.01radians_per_second", 1256},
                                                             {"0.001radians_per_second", 12'566}};
  ASSERT_EQ(std::size(cases), unit_names.size());
  for (const auto& [name, counts] : cases) {
    SCOPED_TRACE(name);
    const auto unit = named(name);
    EXPECT_EQ(counts_of(unit, 4000, 120), counts);
    EXPECT_EQ(counts_of(unit, 4000, -120), -counts);
    EXPECT_EQ(counts_of(unit, 4000, 0), 0);
    if (unit.angle != Angle::radian) {
      EXPECT_EQ(rpm_of(unit, 4000, counts), 120);
      EXPECT_EQ(ramp_of(unit, 4000, 120, 500ms, RampUse::start), 2 * counts);
      EXPECT_EQ(ramp_of(unit, 4000, 120, 500ms, RampUse::brake), 2 * counts);
    }
  }
  EXPECT_EQ(rpm_of(named("0.001radians_per_second"), 4000, 12'566), 120);
  EXPECT_EQ(ramp_of(named("0.001radians_per_second"), 4000, -120, 1s, RampUse::start), 12'566)
      << "a ramp has no sign";
  EXPECT_EQ(counts_of(Rate{.angle = Angle::pulse, .per = Per::minute}, 4000, 120), 480'000);
  EXPECT_EQ(counts_of(Rate{.angle = Angle::pulse, .per = Per::second, .exponent = 3}, 4000, 120), 8);
}

TEST(Units, AMotionIsNeverFasterThanAsked) {
  for (const auto name : unit_names)
    for (const int rpm : {1, 7, 59, 61, 89, 119, 2999, 100'000}) {
      const auto unit = named(name);
      // Of a revolution with so many pulses that no unit of them is coarse.
      const double count = unit.angle == Angle::pulse        ? 60.0 / 65'536
                           : unit.angle == Angle::revolution ? (unit.per == Per::second ? 60 : 1)
                           : unit.angle == Angle::degree     ? 60.0 / 360
                                                             : 60 / (2 * std::numbers::pi);
      const double rpm_per_count = count * std::pow(10, unit.exponent);
      const double granted = counts_of(unit, 65'536, rpm) * rpm_per_count;
      EXPECT_LE(granted, rpm * (1 + 1e-12)) << name;
      EXPECT_GT(granted, rpm - rpm_per_count * (1 + 1e-9)) << name;
      if (unit.angle != Angle::pulse && rpm >= slowest_rpm(unit)) EXPECT_GE(granted, 0.8 * rpm) << name;
    }
}

TEST(Units, ARampStartsNoHarderAndBrakesNoSofterThanTold) {
  const auto turns = named("rev_per_second");  // 60 r/min
  EXPECT_EQ(ramp_of(turns, 4000, 300, 1s, RampUse::start), 5);
  EXPECT_EQ(ramp_of(turns, 4000, 300, 1s, RampUse::brake), 5);
  EXPECT_EQ(ramp_of(turns, 4000, 299, 1s, RampUse::start), 4);
  EXPECT_EQ(ramp_of(turns, 4000, 299, 1s, RampUse::brake), 5);
  EXPECT_EQ(ramp_of(turns, 4000, 301, 1s, RampUse::start), 5);
  EXPECT_EQ(ramp_of(turns, 4000, -301, 1s, RampUse::brake), 6);
  EXPECT_EQ(ramp_of(turns, 4000, 1, 1s, RampUse::brake), 1);
}

TEST(Units, ACountIsWorthAsMuchAsItsUnit) {
  EXPECT_DOUBLE_EQ(rpm_of_count(named("rpm")), 1);
  EXPECT_DOUBLE_EQ(rpm_of_count(named("0.1rpm")), 0.1);
  EXPECT_DOUBLE_EQ(rpm_of_count(named("rev_per_second")), 60);
  EXPECT_DOUBLE_EQ(rpm_of_count(pulses_per_second), 60) << "of one pulse per revolution";
}

TEST(Units, WhatDoesNotFitSaturates) {
  const Rate fine{.angle = Angle::degree, .per = Per::minute, .exponent = -largest_exponent};
  EXPECT_EQ(counts_of(fine, 1, most), most);
  EXPECT_EQ(counts_of(fine, 1, -most), -most);
  EXPECT_EQ(ramp_of(fine, 1, most, 0ns, RampUse::start), most);
  EXPECT_EQ(ramp_of(fine, 1, 1, -1s, RampUse::start), most) << "no less than 1 ms";
  const Rate coarse{.angle = Angle::radian, .per = Per::second, .exponent = largest_exponent};
  EXPECT_EQ(counts_of(coarse, 1, 3000), 0);
  EXPECT_EQ(ramp_of(coarse, 1, 3000, 1s, RampUse::start), 1) << "0 would be no ramp at all";
  EXPECT_EQ(rpm_of(coarse, 1, std::numeric_limits<std::int64_t>::max()), most);
  EXPECT_EQ(rpm_of(coarse, 1, std::numeric_limits<std::int64_t>::min()), -most);
  EXPECT_EQ(rpm_of(pulses_per_second, 0, 5), 300) << "no revolution is empty";
  const Rate most_pulses{.angle = Angle::pulse, .per = Per::minute, .exponent = -largest_exponent};
  EXPECT_EQ(counts_of(most_pulses, std::numeric_limits<std::int64_t>::max(), most), most);
}

TEST(Units, ReadingsAreRoundedToTheNearest) {
  EXPECT_EQ(rpm_of(named("0.1rpm"), 1, 14), 1);
  EXPECT_EQ(rpm_of(named("0.1rpm"), 1, 15), 2);
  EXPECT_EQ(rpm_of(named("0.1rpm"), 1, -15), -2);
  EXPECT_EQ(rpm_of(named("0.1rpm"), 1, -14), -1);
}

TEST(Units, LimitsAreRoundedIntoTheRange) {
  EXPECT_EQ(fastest_rpm(named("0.1rpm"), 29'999), 2999);
  EXPECT_EQ(fastest_rpm(named("rev_per_second"), most), most);
  EXPECT_EQ(fastest_rpm(named("rpm"), -5), 0);
  EXPECT_EQ(slowest_rpm(named("0.001rpm")), 1);
  EXPECT_EQ(slowest_rpm(named("rpm")), 1);
  EXPECT_EQ(slowest_rpm(named("degrees_per_second")), 1);
  EXPECT_EQ(slowest_rpm(named("0.001radians_per_second")), 1);
  EXPECT_EQ(slowest_rpm(named("radians_per_second")), 48) << "5 counts";
  EXPECT_EQ(slowest_rpm(named("rev_per_second")), 300);
  EXPECT_EQ(fastest_pulse_rate(pulses_per_second, 2'000'000), 2'000'000);
  EXPECT_EQ(fastest_pulse_rate({.angle = Angle::pulse, .per = Per::minute, .exponent = 3}, 90), 1500);
  EXPECT_EQ(fastest_pulse_rate({.angle = Angle::pulse, .per = Per::second, .exponent = 9}, most),
            1'000'000'000'000);
}

TEST(UnitObjects, SiUnitsOfVelocity) {
  const std::pair<std::int64_t, std::string_view> cases[] = {
      {0x00B44700, "rpm"},
      {0xFFB44700, "0.1rpm"},
      {0xFDB44700, "0.001rpm"},
      {0x00B40300, "rev_per_second"},
      {0xFDB40300, "0.001rev_per_second"},
      {0x00410300, "degrees_per_second"},
      {0xFE100300, "0.01radians_per_second"},
      {0x00B50300, "pulses_per_second"},
      {static_cast<std::int32_t>(0xFFB44700), "0.1rpm"},  // of an object that is signed by its data sheet
  };
  for (const auto& [value, name] : cases) {
    const auto told = told_velocity({{si_velocity, value}});
    EXPECT_EQ(told.kind, Kind::unit) << name;
    EXPECT_EQ(told.unit, named(name)) << name;
    EXPECT_EQ(told.object, (canopen::Object{0x60A9, 0}));
  }
  EXPECT_EQ(told_velocity({{si_velocity, 0xFAB44700}}).unit, (Rate{.exponent = -6}));
  EXPECT_EQ(told_velocity({}).kind, Kind::nothing);
  EXPECT_EQ(told_velocity({{si_velocity, 0}}).kind, Kind::nothing);
  // Metres; an hour; no time at all; 10^-10; increments where positions are degrees.
  for (const std::int64_t value : {0x00010300, 0x00B44800, 0x00B40000})
    EXPECT_EQ(told_velocity({{si_velocity, value}}).kind, Kind::unclear) << value;
  EXPECT_EQ(told_velocity({{si_velocity, 0xF6B44700}}).kind, Kind::unclear);
  EXPECT_EQ(told_velocity({{si_velocity, 0x00B50300}, {si_position, 0x00410000}}).kind, Kind::unclear);
}

TEST(UnitObjects, NotationAndDimension) {
  constexpr std::uint32_t notation = 0x608B00, dimension = 0x608C00;
  EXPECT_EQ(told_velocity({{dimension, 0xA4}}).unit, revolutions_per_minute);
  EXPECT_EQ(told_velocity({{dimension, 0xA4}}).kind, Kind::unit);
  EXPECT_EQ(told_velocity({{dimension, 0xA4}, {notation, -1}}).unit, named("0.1rpm"));
  EXPECT_EQ(told_velocity({{dimension, 0xA4}, {notation, 0xFF}}).unit, named("0.1rpm")) << "as unsigned";
  EXPECT_EQ(told_velocity({{dimension, 0}, {notation, -1}}).kind, Kind::nothing);
  EXPECT_EQ(told_velocity({{dimension, 0xA6}}).kind, Kind::unclear) << "m/s";
  EXPECT_EQ(told_velocity({{dimension, 0xA4}, {notation, 70}}).kind, Kind::unclear);
  EXPECT_EQ(told_velocity({{dimension, 0xA4}, {si_velocity, 0x00B44700}}).kind, Kind::unit);
  const auto both = told_velocity({{dimension, 0xA4}, {si_velocity, 0x00B40300}});
  EXPECT_EQ(both.kind, Kind::unclear);
  EXPECT_THAT(both.what, AllOf(HasSubstr("60A9h is 00B40300h"), HasSubstr("608Ch is A4h")));
}

TEST(UnitObjects, AFactorLeavesTheUnitUnclear) {
  for (const std::uint32_t index : {0x6093U, 0x6094U, 0x6095U, 0x6096U}) {
    const auto told = [&](std::int64_t numerator, std::int64_t divisor) {
      return told_velocity(
          {{si_velocity, 0x00B44700}, {index << 8U | 1U, numerator}, {index << 8U | 2U, divisor}});
    };
    EXPECT_EQ(told(1, 1).kind, Kind::unit);
    EXPECT_EQ(told(3000, 3000).kind, Kind::unit);
    EXPECT_EQ(told(0, 0).kind, Kind::unit) << "that says nothing";
    EXPECT_EQ(told(3, 2).kind, Kind::unclear);
    EXPECT_THAT(told(3, 2).what, HasSubstr("is 3:2"));
  }
  EXPECT_EQ(told_acceleration({{si_acceleration, 0x00C00300}, {0x609701, 2}, {0x609702, 1}}).kind,
            Kind::unclear);
}

TEST(UnitObjects, Accelerations) {
  EXPECT_EQ(told_acceleration({{si_acceleration, 0x00C00300}}).unit, revolutions_per_minute);
  EXPECT_EQ(told_acceleration({{si_acceleration, 0xFDC00300}}).unit, named("0.001rpm"));
  EXPECT_EQ(told_acceleration({{si_acceleration, 0x00B45700}}).kind, Kind::unclear);
  EXPECT_EQ(told_acceleration({{0x608E00, 0xA4}}).unit, revolutions_per_minute);
  EXPECT_EQ(told_acceleration({{0x608E00, 0}}).kind, Kind::nothing);
  EXPECT_EQ(told_acceleration({{si_velocity, 0x00B44700}}).kind, Kind::nothing);
}

TEST(UnitObjects, ARevolution) {
  const auto fits = [](const Values& values, std::int64_t pulses) {
    const auto told = told_revolution(values);
    EXPECT_TRUE(told);
    return told && told->fits(pulses);
  };
  EXPECT_TRUE(fits({{si_position, 0xFF410000}}, 3600)) << "0.1 degrees";
  EXPECT_FALSE(fits({{si_position, 0xFF410000}}, 4096));
  EXPECT_TRUE(fits({{si_position, 0xFCB40000}}, 10'000));
  EXPECT_TRUE(fits({{si_position, 0xFD100000}}, 6283)) << "mrad";
  EXPECT_TRUE(fits({{0x608F01, 2048}, {0x608F02, 1}}, 2048));
  EXPECT_TRUE(fits({{0x608F01, 2048}, {0x608F02, 1}, {0x609101, 5}, {0x609102, 2}}, 5120)) << "with its gear";
  EXPECT_TRUE(fits({{0x608F01, 2048}, {0x608F02, 1}, {0x609201, 3000}, {0x609202, 1}}, 3000)) << "its feed";
  EXPECT_TRUE(fits({{0x608F01, 2048}, {0x608F02, 1}, {si_position, 0x00B50000}}, 2048));
  EXPECT_TRUE(fits({{0x608F01, 1000}, {0x608F02, 3}}, 333)) << "the nearest";
  for (const auto& values : {Values{}, Values{{0x608F01, 1}, {0x608F02, 1}}, Values{{0x608F01, 2048}},
                             Values{{0x608F01, 2048}, {0x608F02, 1}, {0x609301, 3}, {0x609302, 2}},
                             Values{{0x608F01, 2048}, {0x608F02, 1}, {si_position, 0x00010000}}})
    EXPECT_FALSE(told_revolution(values));
}

constexpr Units planned(UnitSource source) {
  return {.velocity = pulses_per_second,
          .ramps = Ramps::rates,
          .acceleration = pulses_per_second,
          .velocity_source = source};
}

TEST(PlanConflicts, NameBothValuesAndTheKey) {
  const auto from_file = find_conflict(planned(UnitSource::data_sheet), 1000, {{si_velocity, 0x00B44700}});
  ASSERT_TRUE(from_file);
  EXPECT_EQ(from_file->message,
            "its velocities count r/min (60A9h is 00B44700h), and its data sheet says pulses/s");
  EXPECT_THAT(from_file->remedy, AllOf(HasSubstr("write drive: { velocity_unit: rpm }"),
                                       HasSubstr("drive: { objects: { 60A9h: { access: none } } }")));
  const auto by_key = find_conflict(planned(UnitSource::configuration), 1000, {{si_velocity, 0x00B44700}});
  ASSERT_TRUE(by_key);
  EXPECT_THAT(by_key->message, HasSubstr("and drive.velocity_unit says pulses/s"));
  const auto revolution =
      find_conflict(planned(UnitSource::configuration), 1000, {{si_position, 0xFF410000}});
  ASSERT_TRUE(revolution);
  EXPECT_EQ(revolution->message,
            "a revolution has 3600 counts (60A8h is FF410000h), and scale.microstep says 1000 pulses/rev");
  EXPECT_FALSE(find_conflict(planned(UnitSource::configuration), std::nullopt, {{si_position, 0xFF410000}}));
}

TEST(PlanConflicts, AKeySettlesWhatIsUnclear) {
  const Values metres{{si_velocity, 0x00010300}};
  EXPECT_TRUE(find_conflict(planned(UnitSource::data_sheet), 1000, metres));
  EXPECT_FALSE(find_conflict(planned(UnitSource::configuration), 1000, metres));
  for (const auto source : {UnitSource::data_sheet, UnitSource::configuration}) {
    EXPECT_FALSE(find_conflict(planned(source), 1000, {}));
    EXPECT_FALSE(find_conflict(planned(source), 1000, {{si_velocity, 0x00B50300}}));
  }
}

TEST(PlanConflicts, RampsAndPolarity) {
  auto units = planned(UnitSource::configuration);
  EXPECT_TRUE(find_conflict(units, 1000, {{si_acceleration, 0x00C00300}}));
  EXPECT_TRUE(find_conflict(units, 1000, {{si_acceleration, 0x00B45700}})) << "unclear";
  units.acceleration_source = UnitSource::configuration;
  EXPECT_FALSE(find_conflict(units, 1000, {{si_acceleration, 0x00B45700}})) << "the key settles it";
  EXPECT_TRUE(find_conflict(units, 1000, {{si_acceleration, 0x00C00300}}));
  units.acceleration = revolutions_per_minute;
  EXPECT_FALSE(find_conflict(units, 1000, {{si_acceleration, 0x00C00300}}));
  units.ramps = Ramps::times;
  const auto times = find_conflict(units, 1000, {{si_acceleration, 0x00C00300}});
  ASSERT_TRUE(times);
  EXPECT_THAT(times->message, AllOf(HasSubstr("r/min per second"), HasSubstr("times (drive.ramps)")));
  for (const std::int64_t value : {0x80, 0x40, 0xBF, 0x7F})
    EXPECT_TRUE(find_conflict(units, 1000, {{0x607E00, value}})) << value;
  for (const std::int64_t value : {0x00, 0xC0, 0x3F})
    EXPECT_FALSE(find_conflict(units, 1000, {{0x607E00, value}})) << value;
}

}  // namespace
}  // namespace axisd::cia402
