#include "buses/port_number.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

TEST(PortNumber, IsBetween0And65535) {
  EXPECT_EQ(port_number("0"), 0);
  EXPECT_EQ(port_number("7443"), 7443);
  EXPECT_EQ(port_number("65535"), 65535);
  for (const char* text : {"", "65536", "99999", "-1", "+1", " 1", "1 ", "0x10", "http"})
    EXPECT_FALSE(port_number(text)) << text;
}

}  // namespace
}  // namespace axisd
