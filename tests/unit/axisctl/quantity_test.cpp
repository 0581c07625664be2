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

TEST(Quantity, AnotherUnitIsRefusedByName) {
  EXPECT_THAT(refusal([] { parse_value("10deg", "mm", "position"); }), StartsWith("position: "));
  EXPECT_THAT(refusal([] { parse_value("10mm", "mm/s", "--velocity"); }), HasSubstr("mm/s"));
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
