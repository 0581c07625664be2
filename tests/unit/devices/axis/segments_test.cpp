#include "devices/axis/segments.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace axisd {
namespace {

using namespace std::chrono_literals;

/// 1000 pulses/rev, 10 mm/rev: 100 pulses per mm; 10 mm/s are 60 r/min.
struct Table {
  explicit Table(bool invert = false, std::string_view model = "ykd2405pr")
      : descriptor(find_drive_model(model)) {
    axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .invert = invert, .unit = "mm"};
    axis.limits.velocity = 100;
  }
  [[nodiscard]] Result<DriveSegments> drive(const SegmentSettings& segments) const {
    return to_drive(segments, axis, Scale(axis.scale), *descriptor);
  }
  [[nodiscard]] Reason refusal(const SegmentSettings& segments) const {
    const auto table = drive(segments);
    return table ? Reason::internal : table.error().reason;
  }

  const DriveDescriptor* descriptor;
  AxisSettings axis{};
};

const PositionSegment good{.number = 3, .target = -25.5, .velocity = 50, .acceleration_time = 80ms};

TEST(Segments, ThereAndBack) {
  for (const bool invert : {false, true}) {
    const Table table(invert);
    const SegmentSettings settings{
        .positions = {good},
        .velocities = {{.number = 3, .velocity = 10, .acceleration_time = 80ms},
                       {.number = 16, .velocity = 100, .acceleration_time = 2000ms}}};
    const auto drive = table.drive(settings);
    ASSERT_TRUE(drive) << to_string(drive.error());
    EXPECT_EQ(drive->rows[2].pulses, invert ? 2550 : -2550);
    EXPECT_EQ(drive->rows[2].velocity_rpm, 300);
    EXPECT_EQ(drive->rows[2].pv_velocity_rpm, 60);
    EXPECT_EQ(drive->rows[2].acceleration_time, 80ms);
    EXPECT_EQ(drive->rows[15].pv_velocity_rpm, 600);
    EXPECT_EQ(drive->rows[0], DriveSegments::Row{});
    EXPECT_EQ(from_drive(*drive, table.axis, Scale(table.axis.scale)), settings);
  }
}

TEST(Segments, AbsoluteTargetsCountFromHome) {
  Table table;
  table.axis.homing = HomingSettings{.position = 5};
  const auto drive =
      table.drive({.absolute = true, .positions = {{.number = 1, .target = 6, .velocity = 10}}});
  ASSERT_TRUE(drive);
  EXPECT_EQ(drive->rows[0].pulses, 100);
  EXPECT_EQ(from_drive(*drive, table.axis, Scale(table.axis.scale)).positions[0].target, 6);
}

TEST(Segments, NumbersThatTheInputsCannotSelect) {
  for (const auto& [model, most] : {std::pair{"ykd2405pr", 16}, {"ssd2608pr", 15}, {"ess42-r", 7}}) {
    const Table table(false, model);
    auto segment = good;
    segment.number = most;
    EXPECT_TRUE(table.drive({.positions = {segment}})) << model;
    segment.number = most + 1;
    EXPECT_EQ(table.refusal({.positions = {segment}}), Reason::out_of_range) << model;
  }
  auto zero = good;
  zero.number = 0;
  EXPECT_EQ(Table().refusal({.positions = {zero}}), Reason::out_of_range);
}

TEST(Segments, WhatIsRefused) {
  const auto with = [](auto change) {
    auto segment = good;
    change(segment);
    return SegmentSettings{.positions = {segment}};
  };
  const Table table;
  for (const double velocity : {0.0, -1.0, 0.01, 100.5, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(table.refusal(with([&](auto& segment) { segment.velocity = velocity; })), Reason::out_of_range)
        << velocity;
  for (const auto time : {29ms, 2001ms})
    EXPECT_EQ(table.refusal(with([&](auto& segment) { segment.acceleration_time = time; })),
              Reason::out_of_range);
  EXPECT_EQ(table.refusal(with([](auto& segment) { segment.target = 3e7; })), Reason::out_of_range);
  EXPECT_EQ(table.refusal({.positions = {good, good}}), Reason::invalid_argument);
  EXPECT_EQ(table.refusal({.positions = {good},
                           .velocities = {{.number = 3, .velocity = 10, .acceleration_time = 90ms}}}),
            Reason::invalid_argument);
  Table limited;
  limited.axis.limits.position_minimum = -10;
  limited.axis.limits.position_maximum = 10;
  EXPECT_TRUE(limited.drive({.positions = {good}})) << "a distance";
  EXPECT_EQ(limited.refusal({.absolute = true, .positions = {good}}), Reason::soft_limit);
}

}  // namespace
}  // namespace axisd
