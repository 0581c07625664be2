#include "config/quantity.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>

#include "config/unit_conversion.hpp"

namespace axisd::config {
namespace {

using namespace std::chrono_literals;

TEST(Quantity, DecimalsAreExact) {
  const auto decimal = parse_decimal("-12.50");
  ASSERT_TRUE(decimal);
  EXPECT_EQ(decimal->numerator, -25);
  EXPECT_EQ(decimal->denominator, 2);
  EXPECT_EQ(decimal->value, -12.5);
  EXPECT_EQ(parse_decimal("0.1")->value, 0.1);
  EXPECT_EQ(parse_decimal("0.1")->denominator, 10);
  EXPECT_EQ(parse_decimal("1.5e3")->numerator, 1500);
  EXPECT_EQ(parse_decimal("25e-1")->denominator, 2);
  EXPECT_EQ(parse_decimal("+7")->numerator, 7);
  EXPECT_EQ(parse_decimal("+7")->value, 7);
  EXPECT_EQ(parse_decimal(".5")->value, 0.5);
  EXPECT_EQ(parse_decimal("5.")->value, 5);
  EXPECT_EQ(parse_decimal("000000000000000000000012")->numerator, 12);
  EXPECT_EQ(parse_decimal("0e99")->numerator, 0);
  EXPECT_EQ(parse_decimal("999999999999999999")->numerator, 999999999999999999);
}

TEST(Quantity, RefusesWhatIsNoDecimal) {
  for (const auto* text : {"",
                           " ",
                           "-",
                           "+",
                           ".",
                           "1.2.3",
                           "1e",
                           "e5",
                           "--1",
                           "nan",
                           "inf",
                           "-inf",
                           "0x10",
                           "1_000",
                           "1 2",
                           "1,5",
                           "\xC2\xBD",
                           "1e400",
                           "1e101",
                           "1e-400",
                           "1234567890123456789",
                           "0.1234567890123456789"}) {
    EXPECT_FALSE(parse_decimal(text)) << text;
  }
}

TEST(Quantity, SpacesDoNotMatter) {
  for (const auto* text : {"50mm/s", "50 mm/s", " 50  mm / s ", "50.0 mm/s"}) {
    const auto value = parse_in_unit(text, "mm/s");
    ASSERT_TRUE(value) << text;
    EXPECT_EQ(value->value, 50) << text;
  }
  EXPECT_EQ(parse_quantity("90deg")->unit, "deg");
  EXPECT_EQ(parse_quantity("90")->unit, "");
  EXPECT_EQ(parse_quantity("1e3mm")->number.value, 1000);
  EXPECT_EQ(parse_quantity("1 em")->unit, "em") << "not an exponent";
}

TEST(Quantity, SaysHowToWriteIt) {
  EXPECT_EQ(parse_in_unit("50", "mm/s").error().message, "'50' has no unit");
  EXPECT_EQ(parse_in_unit("50", "mm/s").error().suggestion, "write 50 mm/s");
  EXPECT_EQ(parse_in_unit("50 mm", "mm/s").error().message, "unit 'mm' does not fit here");
  EXPECT_EQ(parse_in_unit("50 mm", "mm/s").error().suggestion, "expected mm/s");
  EXPECT_EQ(parse_in_unit("0,5 mm", "mm").error().suggestion,
            "use a point for decimals, and nothing between thousands");
  EXPECT_EQ(parse_in_unit("fast", "mm/s").error().message, "'fast' is not a number");
  EXPECT_EQ(parse_in_unit("5 mm/s/s", "mm/s").error().message, "'mm/s/s' is not a unit");
  EXPECT_EQ(parse_in_unit("5", "mm", UnitRule::optional)->value, 5);
  EXPECT_FALSE(parse_in_unit("5 deg", "mm", UnitRule::optional));
}

TEST(Quantity, SaysWhatAnotherUnitComesTo) {
  const auto hint = [](std::string_view text, std::string_view unit) {
    return parse_in_unit(text, unit).error().suggestion;
  };
  EXPECT_EQ(hint("12cm", "mm"), "write 120 mm");
  EXPECT_EQ(hint("-0.05 m", "mm"), "write -50 mm");
  EXPECT_EQ(hint("120 MM", "mm"), "write 120 mm");
  EXPECT_EQ(hint("1.5 inches", "mm"), "write 38.1 mm");
  EXPECT_EQ(hint("0.25 rev", "deg"), "write 90 deg");
  EXPECT_EQ(hint("90 degrees", "rev"), "write 0.25 rev");
  EXPECT_EQ(hint("3 m/min", "mm/s"), "write 50 mm/s");
  EXPECT_EQ(hint("50 mm/sec", "mm/s"), "write 50 mm/s");
  EXPECT_EQ(hint("120 rpm", "r/min"), "write 120 r/min");
  EXPECT_EQ(hint("2 rev/s", "r/min"), "write 120 r/min");
  EXPECT_EQ(hint("0 cm", "mm"), "write 0 mm");
  for (const auto* text : {"12 deg", "12 mm/s", "12 m/min", "12 x", "12 cm/x", "12 s/mm"})
    EXPECT_EQ(hint(text, "mm"), "expected mm") << text;
  EXPECT_EQ(hint("1 mm/min", "mm/s"), "expected mm/s") << "1/60 is no decimal";
  EXPECT_EQ(hint("5 steps/rev", "pulses/rev"), "expected pulses/rev");
  EXPECT_EQ(parse_ratio_in_unit("1/4 cm/rev", "mm/rev").error().suggestion, "write 2.5 mm/rev");
  EXPECT_EQ(parse_ratio_in_unit("1/3 cm/rev", "mm/rev").error().suggestion, "expected mm/rev");
}

TEST(Quantity, ConvertsToTheNearestNumber) {
  const auto number = [](std::string_view text) { return *parse_decimal(text); };
  EXPECT_EQ(converted_value(number("4.35"), "cm", "mm"), 43.5);
  EXPECT_EQ(converted_value(number("0"), "in", "mm"), 0);
  EXPECT_EQ(converted_value(number("1"), "mm/min", "mm/s"), 1.0 / 60);
  EXPECT_EQ(converted_value(number("1"), "deg", "mm"), std::nullopt);
  EXPECT_EQ(converted_value(number("1"), "mm", "mm/s"), std::nullopt);
  EXPECT_EQ(converted_value(number("1"), "piece", "mm"), std::nullopt);
  EXPECT_EQ(units_like("cm").front(), "mm");
  EXPECT_EQ(units_like("rev/s").back(), "rpm");
  for (const auto* unit : {"s", "piece", "mm/rev", ""}) EXPECT_TRUE(units_like(unit).empty()) << unit;
}

TEST(Quantity, SaysWhatAnotherUnitOfTimeComesTo) {
  const auto hint = [](std::string_view text) { return parse_duration(text).error().suggestion; };
  EXPECT_EQ(hint("2 h"), "write 120 min");
  EXPECT_EQ(hint("90 sec"), "write 90 s");
  EXPECT_EQ(hint("2 Seconds"), "write 2 s");
  EXPECT_EQ(hint("1500 ns"), "write 1.5 us");
  for (const auto* text : {"2 mm", "2 m", "2 days"})
    EXPECT_EQ(hint(text), "expected a time in us, ms, s or min") << text;
}

TEST(Quantity, Durations) {
  EXPECT_EQ(*parse_duration("150ms"), 150ms);
  EXPECT_EQ(*parse_duration("2s"), 2s);
  EXPECT_EQ(*parse_duration("1.5 s"), 1500ms);
  EXPECT_EQ(*parse_duration("20 us"), 20us);
  EXPECT_EQ(*parse_duration("0.5 min"), 30s);
  EXPECT_EQ(*parse_duration("0 ms"), 0ms);
  EXPECT_EQ(parse_duration("150").error().suggestion, "add it: us, ms, s or min");
  EXPECT_FALSE(parse_duration("-1 ms"));
  EXPECT_FALSE(parse_duration("1 h"));
  EXPECT_FALSE(parse_duration("1e17 s"));
  EXPECT_FALSE(parse_duration("ms"));
}

TEST(Quantity, Ratios) {
  EXPECT_EQ(parse_ratio("10/1")->numerator, 10);
  EXPECT_EQ(parse_ratio("3.7 / 1")->numerator, 37);
  EXPECT_EQ(parse_ratio("3.7/1")->denominator, 10);
  EXPECT_EQ(parse_ratio("100/30")->numerator, 10);
  EXPECT_EQ(parse_ratio("0.001/0.003")->denominator, 3);
  for (const auto* text : {"10", "10/0", "-1/2", "1/2/3", "a/b", "/", "1/", "1e17/1e-17"}) {
    EXPECT_FALSE(parse_ratio(text)) << text;
  }
}

TEST(Quantity, RatiosWithUnits) {
  EXPECT_EQ(parse_ratio_in_unit("5 mm/rev", "mm/rev")->numerator, 5);
  EXPECT_EQ(parse_ratio_in_unit("22/7 mm/rev", "mm/rev")->numerator, 22);
  EXPECT_EQ(parse_ratio_in_unit("22/7mm/rev", "mm/rev")->denominator, 7);
  EXPECT_EQ(parse_ratio_in_unit("1/3", "mm/rev").error().suggestion, "write 1/3 mm/rev");
  EXPECT_EQ(parse_ratio_in_unit("5", "mm/rev").error().suggestion, "write 5 mm/rev");
  for (const auto* text :
       {"0 mm/rev", "-5 mm/rev", "5 deg/rev", "22/0 mm/rev", "mm/rev", "22/7 deg/rev", "", "/"}) {
    EXPECT_FALSE(parse_ratio_in_unit(text, "mm/rev")) << text;
  }
}

TEST(Quantity, Formats) {
  EXPECT_EQ(format_number(100), "100");
  EXPECT_EQ(format_number(1.0 / 3), "0.333333333");
  EXPECT_EQ(format_duration(150ms), "150 ms");
  EXPECT_EQ(format_duration(2s), "2 s");
  EXPECT_EQ(format_duration(1500ms), "1500 ms");
  EXPECT_EQ(format_duration(0ms), "0 ms");
  EXPECT_EQ(format_duration(3ns), "3 ns");
}

TEST(Quantity, ObjectAddresses) {
  EXPECT_EQ(parse_object_address("6041h:00").value(), 0x604100U);
  EXPECT_EQ(parse_object_address("1a0Fh:fE").value(), 0x1A0FFEU);
  EXPECT_EQ(parse_object_address("0x604100").value(), 0x604100U);
  EXPECT_EQ(parse_object_address("0xFFFFFF").value(), 0xFFFFFFU);
  EXPECT_EQ(format_object_address(0x604100), "6041h:00");
  EXPECT_EQ(format_object_address(0x1A0FFE), "1A0Fh:FE");
  for (const auto* text : {"", "6041", "6041:00", "6041h", "6041h:0", "6041h:000", "h:", "60g1h:00",
                           "6041h:-1", "+041h:00", "0x", "0x1000000", "0x6041h:00", "24641"}) {
    const auto address = parse_object_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().suggestion, "write index and sub-index, both hexadecimal, such as 6041h:00");
  }
}

}  // namespace
}  // namespace axisd::config
