#include "api/axisctl/drive_view.hpp"

#include <gmock/gmock.h>

#include "api/axisctl/error.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/segment_text.hpp"

namespace axisd::axisctl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::string failure(auto&& action) {
  try {
    action();
  } catch (const Failure& caught) {
    EXPECT_EQ(caught.code(), ExitCode::usage);
    return caught.what();
  }
  return "nothing failed";
}

TEST(Integers, DecimalAndHexadecimalWithSign) {
  EXPECT_EQ(parse_integer("12", "x"), 12);
  EXPECT_EQ(parse_integer("-3", "x"), -3);
  EXPECT_EQ(parse_integer("0x1F", "x"), 31);
  EXPECT_EQ(parse_integer("-0x10", "x"), -16);
  for (const auto* text : {"", "-", "0x", "1.5", "--1", "12a", "0x-1", "99999999999999999999"})
    EXPECT_THAT(failure([&] { parse_integer(text, "count"); }), HasSubstr("count: ")) << text;
}

TEST(Assignments, AreNameAndValue) {
  const auto value = parse_assignment("current=0x7");
  EXPECT_EQ(value.name(), "current");
  EXPECT_EQ(value.value(), 7);
  EXPECT_THAT(failure([] { parse_assignment("current"); }), HasSubstr("NAME=VALUE"));
  EXPECT_THAT(failure([] { parse_assignment("=1"); }), HasSubstr("NAME=VALUE"));
  EXPECT_THAT(failure([] { parse_assignment("current=six"); }), HasSubstr("current: 'six'"));
}

TEST(DriveDetails, TerminalsHaveTheSameFunctionsOrTheirOwn) {
  v1::GetDriveResponse drive;
  for (const auto* name : {"X0", "X1"}) {
    auto& input = *drive.add_inputs();
    input.set_name(name);
    input.add_functions("home");
    input.add_functions("stop");
  }
  EXPECT_THAT(drive_details(drive), HasSubstr("X0 X1: home, stop\n"));
  drive.mutable_inputs(1)->set_functions(0, "positive_limit");
  EXPECT_THAT(drive_details(drive), HasSubstr("X0: home, stop; X1: positive_limit, stop\n"));
}

TEST(DriveDetails, NumbersOfHomingMethodsAreRanges) {
  v1::GetDriveResponse drive;
  for (const auto* method : {"home_positive", "negative_limit", "-3", "-2", "-1", "1", "17", "18", "37"})
    drive.add_homing_methods(method);
  EXPECT_THAT(drive_details(drive),
              HasSubstr("homing:       home_positive, negative_limit, -3 to -1, 1, 17 to 18, 37\n"));
  drive.clear_homing_methods();
  EXPECT_THAT(drive_details(drive), Not(HasSubstr("homing:")));
}

TEST(Patterns, ArePartsOfNamesOrShellPatterns) {
  EXPECT_TRUE(fits("start_speed", ""));
  EXPECT_TRUE(fits("start_speed", "speed"));
  EXPECT_FALSE(fits("start_speed", "sped"));
  EXPECT_TRUE(fits("start_speed", "*_speed"));
  EXPECT_FALSE(fits("start_speed", "speed*"));
}

TEST(Parameters, TableShowsOwnersAndWhatDiffers) {
  v1::ListParametersResponse catalogue;
  auto& parameter = *catalogue.add_parameters();
  parameter.set_name("microstep");
  parameter.set_address(0x11);
  parameter.set_maximum(15);
  parameter.set_default_value(8);
  parameter.set_access(v1::PARAMETER_ACCESS_READ_WRITE_SAVED);
  parameter.set_configured_by("scale.microstep");
  EXPECT_THAT(parameter_table(catalogue, {}, {}).lines(false),
              ElementsAre("NAME       ADDRESS  RANGE  DEFAULT  ACCESS  UNIT  OWNER",
                          "microstep  0x0011   0..15        8  saved         scale.microstep"));
  google::protobuf::RepeatedPtrField<v1::ParameterValue> values;
  values.Add()->set_name("microstep");
  values[0].set_value(13);
  EXPECT_THAT(parameter_table(catalogue, values, {.values = true}).lines(true).at(1),
              HasSubstr("\x1b[1m13\x1b[0m"));
}

TEST(Segments, AreReadWithTheAxisUnit) {
  const auto position = parse_position_segment("1:50mm:20mm/s:150ms", "mm");
  EXPECT_EQ(position.number(), 1U);
  EXPECT_EQ(position.target(), 50);
  EXPECT_EQ(position.velocity(), 20);
  EXPECT_EQ(position.acceleration_time().nanos(), 150'000'000);
  EXPECT_FALSE(parse_position_segment("16:-5:20", "mm").has_acceleration_time());
  EXPECT_EQ(parse_velocity_segment("2:5mm/s:1s", "mm").acceleration_time().seconds(), 1);
  EXPECT_FALSE(parse_velocity_segment("2:5", "mm").has_acceleration_time());
  EXPECT_THAT(failure([] { parse_position_segment("1:5", "mm"); }), HasSubstr("NUMBER:TARGET:VELOCITY"));
  EXPECT_THAT(failure([] { parse_position_segment("17:5:5", "mm"); }), HasSubstr("permitted: 1 to 16"));
  EXPECT_THAT(failure([] { parse_position_segment("1:5deg:5", "mm"); }), HasSubstr("target"));
  EXPECT_THAT(failure([] { parse_velocity_segment("1", "mm"); }), HasSubstr("NUMBER:VELOCITY"));
  EXPECT_THAT(failure([] { parse_velocity_segment("1:2:3ms:4", "mm"); }), HasSubstr("NUMBER:VELOCITY"));
  EXPECT_THAT(failure([] { parse_segment_json("[]", "file"); }), HasSubstr("file: not a segment table"));
}

}  // namespace
}  // namespace axisd::axisctl
