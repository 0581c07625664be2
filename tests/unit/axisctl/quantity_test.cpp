#include "api/axisctl/quantity.hpp"

#include <gmock/gmock.h>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::StartsWith;

std::string refusal(auto&& parse) {
  try {
    parse();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), ExitCode::usage);
    return failure.what();
  }
  return "accepted";
}

TEST(Quantity, UnitMayBeWrittenOrLeftOut) {
  EXPECT_DOUBLE_EQ(parse_value("120mm", "mm", "position"), 120);
  EXPECT_DOUBLE_EQ(parse_value("120 mm", "mm", "position"), 120);
  EXPECT_DOUBLE_EQ(parse_value("-10", "mm", "position"), -10);
  EXPECT_DOUBLE_EQ(parse_value("-0.5", "deg", "position"), -0.5);
  EXPECT_DOUBLE_EQ(parse_value("50mm/s", "mm/s", "--velocity"), 50);
}

TEST(Quantity, AnotherUnitThatMeasuresTheSameIsConverted) {
  EXPECT_EQ(parse_value("12cm", "mm", "position"), 120);
  EXPECT_EQ(parse_value("0.5m", "mm", "position"), 500);
  EXPECT_EQ(parse_value("-0.5 in", "mm", "distance"), -12.7);
  EXPECT_EQ(parse_value("0 cm", "mm", "position"), 0);
  EXPECT_EQ(parse_value("30 rpm", "deg/s", "velocity"), 180);
  EXPECT_EQ(parse_value("1 rev/s", "deg/s", "velocity"), 360);
  EXPECT_EQ(parse_value("0.25rev", "deg", "position"), 90);
  EXPECT_EQ(parse_value("90 deg", "rev", "position"), 0.25);
  EXPECT_EQ(parse_value("3 m/min", "mm/s", "--velocity"), 50);
  EXPECT_DOUBLE_EQ(parse_value("1 mm/min", "mm/s", "--velocity"), 1.0 / 60);
}

TEST(Quantity, WhatMeasuresSomethingElseIsRefusedWithTheUnitsThatFit) {
  EXPECT_EQ(refusal([] { parse_value("10deg", "mm", "position"); }),
            "position: unit 'deg' does not fit here; write it in mm, cm, m, um or in");
  EXPECT_EQ(refusal([] { parse_value("10mm", "deg/s", "--velocity"); }),
            "--velocity: unit 'mm' does not fit here; write it in deg/s, deg/min, rev/s or rpm");
  EXPECT_EQ(refusal([] { parse_value("10mm", "pieces", "position"); }),
            "position: unit 'mm' does not fit here; write it in pieces");
  for (const char* text : {"1 rev", "1 mm/s", "5 s", "1 rpm", "1 mm/x", "1 pulses", "5M"})
    EXPECT_THAT(refusal([&] { parse_value(text, "mm", "position"); }), HasSubstr("write it in mm")) << text;
}

TEST(Quantity, SinceANumberOrForSoLong) {
  EXPECT_EQ(parse_since("120", "--since").number, 120U);
  EXPECT_EQ(parse_since("0", "--since").number, 0U);
  EXPECT_FALSE(parse_since("10min", "--since").number);
  EXPECT_EQ(parse_since("10min", "--since").ago, 10min);
  EXPECT_EQ(parse_since("8h", "--since").ago, 8h);
  EXPECT_EQ(parse_since("1.5h", "--since").ago, 90min);
  EXPECT_EQ(parse_since("7d", "--since").ago, 168h);
  EXPECT_EQ(
      refusal([] { (void)parse_since("foo", "--since"); }),
      "--since: 'foo' is neither a number nor a time; write 120 for what comes behind it, or 90s, 10min, "
      "8h or 7d for what is younger");
  for (const char* text : {"", "-5", "-5s", "-1h", "h", "1e9d", "1e3", "99999999999999999999"})
    EXPECT_THAT(refusal([&] { (void)parse_since(text, "--since"); }), StartsWith("--since: ")) << text;
}

TEST(Quantity, OnlyFiniteNumbers) {
  for (const char* text : {"", "mm", "nan", "inf", "-inf", "1e999", "1,5", "0x10", "--5"})
    EXPECT_THAT(refusal([&] { parse_value(text, "mm", "position"); }), StartsWith("position: ")) << text;
}

TEST(Quantity, TimesCarryTheirUnit) {
  EXPECT_EQ(parse_duration("150ms", "--hold"), 150ms);
  EXPECT_EQ(parse_duration("0.5s", "--hold"), 500ms);
  EXPECT_EQ(parse_duration("0s", "--hold"), 0ms);
  for (const char* text : {"150", "-1s", "5mm", "s", "1e12s"})
    EXPECT_THAT(refusal([&] { parse_duration(text, "--hold"); }), StartsWith("--hold: ")) << text;
}

}  // namespace
}  // namespace axisd::axisctl
