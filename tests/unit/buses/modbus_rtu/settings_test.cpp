#include "buses/modbus_rtu/settings.hpp"

#include <gtest/gtest.h>

namespace axisd::modbus_rtu {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

LineSettings line(int baud, Parity parity = Parity::none, int stop_bits = 1) {
  return {
      .name = "line-a", .port = "sim", .baud = baud, .format = {.parity = parity, .stop_bits = stop_bits}};
}

TEST(WireTime, CountsStartDataParityAndStopBits) {
  EXPECT_EQ(wire_time(line(9600), 0), nanoseconds(0));
  EXPECT_EQ(wire_time(line(10000), 1), microseconds(1000));
  EXPECT_EQ(wire_time(line(10000, Parity::none, 2), 1), microseconds(1100));
  EXPECT_EQ(wire_time(line(10000, Parity::even), 2), microseconds(2200));
  EXPECT_EQ(wire_time(line(10000, Parity::odd, 2), 2), microseconds(2400));
}

TEST(SerialSettings, AsText) {
  EXPECT_EQ(to_string(Format{}), "8N1");
  EXPECT_EQ(to_string(Format{.parity = Parity::odd, .stop_bits = 2}), "8O2");
  EXPECT_EQ(to_string(line(9600, Parity::even).serial()), "9600 baud 8E1");
}

TEST(WireTime, IsNeverRoundedDown) {
  EXPECT_EQ(wire_time(line(115200), 1), nanoseconds(86806));  // 86805.55..
  EXPECT_EQ(wire_time(line(115200), 256), nanoseconds(22'222'223));
  EXPECT_EQ(wire_time(line(256000), 1), nanoseconds(39063));  // 39062.5
}

TEST(Silence, IsThreeAndAHalfCharactersUpTo19200) {
  EXPECT_EQ(silence(line(10000)), microseconds(3500));
  EXPECT_EQ(silence(line(10000, Parity::even)), microseconds(3850));
  EXPECT_EQ(silence(line(19200, Parity::even)), nanoseconds(2'005'209));  // 2005208.33
  EXPECT_EQ(silence(line(14400)), nanoseconds(2'430'556));                // 2430555.55
}

TEST(Silence, IsFixedAbove19200) {
  EXPECT_EQ(silence(line(38400)), microseconds(1750));
  EXPECT_EQ(silence(line(256000, Parity::even)), microseconds(1750));
}

}  // namespace
}  // namespace axisd::modbus_rtu
