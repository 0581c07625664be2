// What is refused before anything reaches a bus.
#include "api/server/bus_validate.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "api/server/serial_format.hpp"
#include "tests/unit/api/fake_machine.hpp"

namespace axisd::server {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::TransactRequest reading(std::uint32_t node, std::uint32_t address, std::uint32_t count) {
  v1::TransactRequest request;
  request.set_bus("line-a");
  request.set_node(node);
  request.set_address(address);
  request.set_read(count);
  return request;
}

TEST(BusValidate, ReadsNeedANodeAndAPermittedSpan) {
  const auto read = to_transact(reading(9, 0x10, 4));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->node, 9);
  EXPECT_EQ(read->count, 4);
  EXPECT_TRUE(read->values.empty());
  EXPECT_TRUE(to_transact(reading(247, 65535, 1)));
  EXPECT_TRUE(to_transact(reading(1, 0, 125)));
  EXPECT_THAT(to_transact(reading(0, 0, 1)).error().remedy, HasSubstr("every node"));
  EXPECT_EQ(to_transact(reading(248, 0, 1)).error().permitted->maximum, 247);
  EXPECT_EQ(to_transact(reading(256 + 9, 0, 1)).error().reason, Reason::out_of_range);
  EXPECT_EQ(to_transact(reading(1, 0, 0)).error().permitted->minimum, 1);
  EXPECT_EQ(to_transact(reading(1, 0, 126)).error().permitted->maximum, 125);
  EXPECT_EQ(to_transact(reading(1, 65536, 1)).error().reason, Reason::out_of_range);
  EXPECT_THAT(to_transact(reading(1, 65535, 2)).error().message, HasSubstr("beyond 65535"));
  auto nowhere = reading(1, 0, 1);
  nowhere.clear_bus();
  EXPECT_THAT(to_transact(nowhere).error().message, HasSubstr("bus"));
}

TEST(BusValidate, WritesNeedValuesThatFitARegister) {
  auto request = reading(9, 0x10, 1);
  request.clear_operation();
  EXPECT_THAT(to_transact(request).error().message, HasSubstr("neither read nor write"));
  request.mutable_write();
  EXPECT_EQ(to_transact(request).error().reason, Reason::out_of_range);
  request.mutable_write()->add_values(65535);
  request.mutable_write()->add_values(0);
  EXPECT_THAT(to_transact(request)->values, ElementsAre(65535, 0));
  request.mutable_write()->add_values(65536);
  EXPECT_EQ(to_transact(request).error().reason, Reason::out_of_range);
  request.mutable_write()->clear_values();
  for (int i = 0; i < 124; ++i) request.mutable_write()->add_values(1);
  EXPECT_EQ(to_transact(request).error().permitted->maximum, 123);
}

TEST(BusValidate, ObjectsAreWrittenInTheSizeOfTheirType) {
  v1::TransactRequest request;
  request.set_bus("can0");
  request.set_node(127);
  request.set_address(0xFFFFFF);
  EXPECT_FALSE(names_object(request));
  request.mutable_read_object();
  ASSERT_TRUE(names_object(request));
  EXPECT_EQ(to_object_request(request)->object, 0xFFFFFFU);
  EXPECT_TRUE(to_object_request(request)->bytes.empty());
  request.set_address(0x1000000);
  EXPECT_EQ(to_object_request(request).error().reason, Reason::out_of_range);
  request.set_address(0x607A00);
  for (const auto node : {0U, 128U, 256U + 5U}) {
    request.set_node(node);
    EXPECT_EQ(to_object_request(request).error().permitted->maximum, 127) << node;
  }
  request.set_node(5);
  auto& content = *request.mutable_write_object();
  EXPECT_EQ(to_object_request(request).error().reason, Reason::out_of_range) << "nothing to write";
  auto& number = *content.mutable_number();
  number.set_value(-1000);
  EXPECT_THAT(to_object_request(request).error().message, HasSubstr("type is missing"));
  number.set_type(v1::PARAMETER_TYPE_INT32);
  EXPECT_THAT(to_object_request(request)->bytes, ElementsAre(0x18, 0xFC, 0xFF, 0xFF));
  number.set_type(v1::PARAMETER_TYPE_INT8);
  EXPECT_EQ(to_object_request(request).error().permitted->minimum, -128);
  number.set_type(v1::PARAMETER_TYPE_UINT16);
  EXPECT_EQ(to_object_request(request).error().permitted->maximum, 65535);
  number.set_type(v1::PARAMETER_TYPE_UINT32);
  number.set_value(0xFFFFFFFF);
  EXPECT_THAT(to_object_request(request)->bytes, ElementsAre(0xFF, 0xFF, 0xFF, 0xFF));
  content.set_data("abcde");
  EXPECT_EQ(to_object_request(request)->bytes.size(), 5U);
  content.set_data(std::string(257, 'x'));
  EXPECT_EQ(to_object_request(request).error().permitted->maximum, 256);
  request.clear_bus();
  EXPECT_THAT(to_object_request(request).error().message, HasSubstr("bus"));
}

TEST(BusValidate, ScansHaveDefaultsAndBounds) {
  v1::ScanRequest request;
  EXPECT_THAT(to_scan(request).error().message, HasSubstr("bus"));
  request.set_bus("line-a");
  auto scan = to_scan(request);
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->first_node, 1);
  EXPECT_EQ(scan->last_node, 127);
  EXPECT_EQ(scan->reply_timeout, Duration::zero());
  request.set_first_node(200);
  EXPECT_EQ(to_scan(request)->last_node, 200);
  request.set_last_node(199);
  EXPECT_THAT(to_scan(request).error().message, HasSubstr("above last_node"));
  request.set_last_node(248);
  EXPECT_EQ(to_scan(request).error().permitted->maximum, 247);
  request.set_last_node(201);
  request.mutable_reply_timeout()->set_nanos(20'000'000);
  EXPECT_EQ(to_scan(request)->reply_timeout, Duration(20ms));
  request.mutable_reply_timeout()->set_seconds(2);
  EXPECT_EQ(to_scan(request).error().permitted->maximum, 1000);
}

TEST(BusValidate, ScansTryEachRateAndFormatOnce) {
  v1::ScanRequest request;
  request.set_bus("line-a");
  request.add_bauds(9600);
  request.add_bauds(115200);
  request.add_formats("8N1");
  request.add_formats("8O1");
  const auto scan = to_scan(request);
  ASSERT_TRUE(scan);
  EXPECT_THAT(scan->bauds, ElementsAre(9600, 115200));
  EXPECT_EQ(scan->formats[1].parity, modbus_rtu::Parity::odd);
  auto again = request;
  again.add_bauds(9600);
  EXPECT_THAT(to_scan(again).error().message, HasSubstr("twice"));
  again = request;
  again.add_formats("8N1");
  EXPECT_THAT(to_scan(again).error().message, HasSubstr("twice"));
  request.add_bauds(0);
  EXPECT_EQ(to_scan(request).error().reason, Reason::out_of_range);
  request.mutable_bauds()->RemoveLast();
  request.add_formats("8X1");
  EXPECT_THAT(to_scan(request).error().message, HasSubstr("8X1"));
}

TEST(BusValidate, FormatsReadAsTheyAreWritten) {
  for (const auto* text : {"8N1", "8N2", "8E1", "8O1"}) EXPECT_EQ(to_text(*parse_format(text)), text);
  EXPECT_FALSE(parse_format("8E2"));
  EXPECT_FALSE(parse_format(""));
}

TEST(BusValidate, DeviceWritesNeedAKnownWritableRegister) {
  testing::FakeMachine machine;
  v1::WriteDeviceRequest request;
  const auto error = [&] {
    const auto result = check_device_write(request, machine.bus_access());
    return result ? Error{.message = "accepted"} : result.error();
  };
  request.set_device("valve");
  EXPECT_EQ(error().remedy, "did you mean valves?");
  request.set_device("valves");
  request.set_register_("presure");
  EXPECT_EQ(error().remedy, "did you mean pressure?");
  request.set_register_("flow");
  EXPECT_THAT(error().message, HasSubstr("read-only"));
  request.set_register_("pressure");
  EXPECT_THAT(error().message, HasSubstr("value is missing"));
  request.set_value(NAN);
  EXPECT_THAT(error().message, HasSubstr("not a finite number"));
  request.set_value(0);
  EXPECT_EQ(error().message, "accepted");
}

}  // namespace
}  // namespace axisd::server
