// What is refused before anything reaches a drive, on the catalogue of a real model.
#include "api/server/drive_validate.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <limits>

#include "api/server/drive_convert.hpp"
#include "tests/unit/api/fake_machine.hpp"

namespace axisd::server {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DriveValidate : public ::testing::Test {
 protected:
  /// The error of a batch of one.
  Error write_error(const std::string& name, std::int64_t value) {
    v1::WriteParametersRequest request;
    request.add_values()->set_name(name);
    request.mutable_values(0)->set_value(value);
    const auto result = parameters_to_write(request, drive_);
    return result ? Error{.message = "accepted"} : result.error();
  }
  Error read_error(std::initializer_list<const char*> names) {
    v1::ReadParametersRequest request;
    for (const auto* name : names) request.add_names(name);
    const auto result = parameters_to_read(request, drive_);
    return result ? Error{.message = "accepted"} : result.error();
  }
  Error segment_error(const v1::SegmentTable& table) {
    const auto result = segments_to_write(table, drive_);
    return result ? Error{.message = "accepted"} : result.error();
  }

  testing::FakeMachine machine_;
  KnownDrive drive_ = *find_drive(machine_, "feeder");
};

v1::SegmentTable one_position(std::uint32_t number, double target, double velocity) {
  v1::SegmentTable table;
  auto& row = *table.add_positions();
  row.set_number(number);
  row.set_target(target);
  row.set_velocity(velocity);
  return table;
}

TEST_F(DriveValidate, AxisAndModelMustBeKnown) {
  EXPECT_EQ(find_drive(machine_, "nobody").error().reason, Reason::unknown_axis);
  EXPECT_EQ(find_drive(machine_, "").error().reason, Reason::invalid_argument);
  EXPECT_EQ(drive_.model->model, "ykd2405pr");
}

TEST_F(DriveValidate, ReadingAllLeavesOutWhatCannotBeRead) {
  const auto all = parameters_to_read({}, drive_);
  ASSERT_TRUE(all);
  const auto readable = std::ranges::count_if(drive_.model->parameters,
                                              [](const auto& spec) { return spec.access != Access::wo; });
  EXPECT_EQ(static_cast<std::ptrdiff_t>(all->size()), readable);
  EXPECT_LT(all->size(), drive_.model->parameters.size());
  EXPECT_EQ(std::ranges::count(*all, 0x0028U), 0);
}

TEST_F(DriveValidate, ReadingNamesTheNearestParameter) {
  const auto typo = read_error({"start_sped"});
  EXPECT_EQ(typo.reason, Reason::invalid_argument);
  EXPECT_THAT(typo.message, HasSubstr("ykd2405pr has no parameter \"start_sped\""));
  EXPECT_EQ(typo.remedy, "did you mean start_speed?");
  EXPECT_EQ(read_error({"something_else_entirely"}).remedy, "ListParameters names all");
  EXPECT_THAT(read_error({""}).message, HasSubstr("without a name"));
}

TEST_F(DriveValidate, ReadingAWriteOnlyRegisterOrOneTwiceIsRefusedWithItsAddress) {
  const auto trigger = read_error({"current", "stop"});
  EXPECT_EQ(trigger.reason, Reason::invalid_argument);
  EXPECT_THAT(trigger.message, HasSubstr("write-only"));
  EXPECT_EQ(trigger.where.object, 0x0028U);
  EXPECT_EQ(trigger.where.bus, "line-a");
  EXPECT_EQ(trigger.outcome, Outcome::not_sent);
  EXPECT_THAT(read_error({"current", "current"}).message, HasSubstr("named twice"));
}

TEST_F(DriveValidate, WritingATriggerPointsToTheCall) {
  const auto start = write_error("start", 1);
  EXPECT_EQ(start.reason, Reason::invalid_argument);
  EXPECT_EQ(start.remedy, "use AxisService.MoveAbsolute");
  EXPECT_THAT(write_error("parameter_setting", 2).remedy, HasSubstr("DriveService.SaveParameters"));
  for (const auto& spec : drive_.model->parameters)
    if (spec.access == Access::wo) {
      EXPECT_THAT(write_error(std::string(spec.name), spec.minimum).remedy, HasSubstr("Service."))
          << spec.name;
    }
}

TEST_F(DriveValidate, WritingReadOnlyUnknownOrOutOfRangeIsRefused) {
  EXPECT_THAT(write_error("moving", 1).message, HasSubstr("read-only"));
  EXPECT_EQ(write_error("curent", 1).remedy, "did you mean current?");
  const auto high = write_error("current", 12);
  EXPECT_EQ(high.reason, Reason::out_of_range);
  EXPECT_EQ(high.permitted->minimum, 0);
  EXPECT_EQ(high.permitted->maximum, 11);
  EXPECT_EQ(high.where.object, 0x0010U);
  EXPECT_EQ(write_error("current", -1).reason, Reason::out_of_range);
  EXPECT_EQ(write_error("current", std::numeric_limits<std::int64_t>::min()).reason, Reason::out_of_range);
  EXPECT_EQ(write_error("current", 11).message, "accepted");
  EXPECT_EQ(write_error("maximum_speed", -3000).message, "accepted");
}

TEST_F(DriveValidate, ABatchIsRefusedAsAWhole) {
  v1::WriteParametersRequest request;
  EXPECT_THAT(parameters_to_write(request, drive_).error().message, HasSubstr("no values"));
  request.add_values()->set_name("current");
  request.add_values()->set_name("moving");
  EXPECT_FALSE(parameters_to_write(request, drive_));
  request.mutable_values(1)->set_name("current");
  EXPECT_THAT(parameters_to_write(request, drive_).error().message, HasSubstr("named twice"));
  request.mutable_values(1)->set_name("lock_current");
  request.mutable_values(1)->set_value(1);
  EXPECT_THAT(*parameters_to_write(request, drive_),
              ElementsAre(ParameterValue{0x0010, 0}, ParameterValue{0x0012, 1}));
}

TEST_F(DriveValidate, ConfirmationRepeatsTheName) {
  EXPECT_TRUE(check_confirmed("feeder", "feeder"));
  const auto missing = check_confirmed("feeder", "");
  EXPECT_EQ(missing.error().reason, Reason::invalid_argument);
  EXPECT_THAT(missing.error().remedy, HasSubstr("repeat the axis's name"));
  EXPECT_THAT(check_confirmed("feeder", "yes").error().message, HasSubstr("\"yes\""));
}

TEST_F(DriveValidate, SegmentsHaveNumbersAndFiniteValues) {
  EXPECT_EQ(segment_error(one_position(1, -5, 10)).message, "accepted");
  EXPECT_EQ(segment_error(one_position(0, 5, 10)).reason, Reason::out_of_range);
  EXPECT_EQ(segment_error(one_position(17, 5, 10)).permitted->maximum, 16);
  EXPECT_THAT(segment_error(one_position(1, NAN, 10)).message, HasSubstr("target"));
  for (const double velocity : {0.0, -1.0, double(NAN), double(INFINITY)})
    EXPECT_THAT(segment_error(one_position(1, 5, velocity)).message, HasSubstr("velocity")) << velocity;
  auto twice = one_position(1, 5, 10);
  *twice.add_positions() = twice.positions(0);
  EXPECT_THAT(segment_error(twice).message, HasSubstr("given twice"));
}

TEST_F(DriveValidate, SegmentsOfOneNumberShareTheirTime) {
  auto table = one_position(3, 5, 10);
  table.set_absolute(true);
  auto& velocity = *table.add_velocities();
  velocity.set_number(3);
  velocity.set_velocity(2);
  auto settings = segments_to_write(table, drive_);
  ASSERT_TRUE(settings);
  EXPECT_TRUE(settings->absolute);
  EXPECT_EQ(settings->positions[0].acceleration_time, Duration(100ms));
  velocity.mutable_acceleration_time()->set_nanos(250'000'000);
  settings = segments_to_write(table, drive_);
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->positions[0].acceleration_time, Duration(250ms));
  EXPECT_EQ(settings->velocities[0].acceleration_time, Duration(250ms));
  table.mutable_positions(0)->mutable_acceleration_time()->set_nanos(50'000'000);
  EXPECT_THAT(segment_error(table).message, HasSubstr("different acceleration times"));
  velocity.clear_acceleration_time();
  table.mutable_positions(0)->mutable_acceleration_time()->set_nanos(-1);
  EXPECT_EQ(segment_error(table).reason, Reason::out_of_range);
}

TEST_F(DriveValidate, AddressesAndSerialSettingsAreThoseOfTheModel) {
  v1::ReaddressRequest address;
  address.set_axis("feeder");
  address.set_node(7);
  EXPECT_THAT(serial_change(address, drive_).error().message, HasSubstr("confirm"));
  address.set_confirm("feeder");
  EXPECT_EQ(serial_change(address, drive_)->node, 7);
  EXPECT_EQ(serial_change(address, drive_)->verify, Duration::zero());
  address.mutable_verify()->set_seconds(601);
  EXPECT_EQ(serial_change(address, drive_).error().permitted->maximum, 600);
  address.mutable_verify()->set_seconds(600);
  EXPECT_EQ(serial_change(address, drive_)->verify, Duration(600s));
  for (const std::uint32_t node : {0U, 128U, 256U + 7U}) {
    address.set_node(node);
    EXPECT_EQ(serial_change(address, drive_).error().reason, Reason::out_of_range) << node;
  }

  v1::SetSerialRequest serial;
  serial.set_axis("feeder");
  serial.set_confirm("feeder");
  EXPECT_THAT(serial_change(serial, drive_).error().message, HasSubstr("neither"));
  serial.set_baud(12345);
  EXPECT_THAT(serial_change(serial, drive_).error().remedy, HasSubstr("9600"));
  serial.set_baud(9600);
  serial.set_format("7E1");
  EXPECT_THAT(serial_change(serial, drive_).error().remedy, HasSubstr("8N1, 8N2, 8E1, 8O1"));
  serial.set_format("8E1");
  const auto change = serial_change(serial, drive_);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->baud, 9600);
  EXPECT_EQ(change->format->parity, modbus_rtu::Parity::even);
}

TEST(DriveConvert, TypeSaysSizeAndSign) {
  const auto converted = [](ParameterType type, std::int64_t minimum, std::int64_t maximum) {
    v1::Parameter parameter;
    to_proto(ParameterSpec{.address = 1,
                           .name = "x",
                           .access = Access::rw,
                           .minimum = minimum,
                           .maximum = maximum,
                           .default_value = {},
                           .unit = "",
                           .description = "",
                           .type = type},
             "", parameter);
    EXPECT_FALSE(parameter.has_default_value());
    EXPECT_EQ(parameter.minimum(), minimum);
    EXPECT_EQ(parameter.maximum(), maximum);
    return parameter.type();
  };
  EXPECT_EQ(converted(ParameterType::u8, 0, 255), v1::PARAMETER_TYPE_UINT8);
  EXPECT_EQ(converted(ParameterType::i8, -128, 127), v1::PARAMETER_TYPE_INT8);
  EXPECT_EQ(converted(ParameterType::u16, -32768, 65535), v1::PARAMETER_TYPE_UINT16);  // any word
  EXPECT_EQ(converted(ParameterType::i16, -3000, 3000), v1::PARAMETER_TYPE_INT16);
  EXPECT_EQ(converted(ParameterType::u32, 0, 4294967295), v1::PARAMETER_TYPE_UINT32);
  EXPECT_EQ(converted(ParameterType::i32, -1000000, 1000000), v1::PARAMETER_TYPE_INT32);
}

}  // namespace
}  // namespace axisd::server
